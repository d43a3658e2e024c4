"""Serves a picture to a browser on this machine: one page, frames by long polling, and events.

docs/browser.md says what is protected from whom. In short: the server answers on the loopback address alone; the page
and its files hold no secret, and every other request must carry the token that the terminal printed, in a header that
no other page can set; requests that another page makes are refused by their Host and Origin; and the sizes, the rate
and the time of what is sent are limited.
"""

import contextlib
import http.server
import io
import json
import secrets
import select
import socket
import socketserver
import struct
import sys
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from concurrent.futures import TimeoutError as FutureTimeout
from http import HTTPStatus
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from taichi_tracer.apps.session import FILES, Session
from taichi_tracer.system.errors import InputError

LOOPBACK = "127.0.0.1"
FIRST_PORT, LAST_PORT = 8765, 8865  # the first free one is taken
TOKEN = "X-Token"  # the header with the token: a cookie would be sent to every port of this machine
MOST_BODY = 64 * 1024  # bytes of a request
MOST_EVENTS = 256  # of a request
RATE = 2000  # events per second, of all pages together
MOST_CONNECTIONS = 24  # at the same time, of those who have shown the token; and as many of others
HEAD = 3.0  # seconds in which a request must be complete, of who has not shown the token yet
IDLE = 30.0  # seconds after which another connection is closed if no request comes
LONGEST_NUMBER = 15  # digits
PATIENCE = 10.0  # seconds that a request for a frame waits
LOOK = 0.1  # seconds between two looks whether a page that waits is still there
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
SCRIPT, STYLE = "text/javascript; charset=utf-8", "text/css; charset=utf-8"
PAGES = {"/": ("live.html", "text/html; charset=utf-8"), "/live.css": ("live.css", STYLE)}
PAGES |= {f"/{name}": (name, SCRIPT) for name in ("live.js", "host.js")}
FOLDER = Path(__file__).with_name("live")


class Refused(Exception):
    """A request that is not answered; its status and its reason are."""

    def __init__(self, status: HTTPStatus, why: str) -> None:
        super().__init__(why)
        self.status = status


class Handler(http.server.BaseHTTPRequestHandler):
    """Answers one connection."""

    protocol_version = "HTTP/1.1"
    server: "Server"
    timeout = IDLE
    disable_nagle_algorithm = True
    deadline = 0.0  # until then the present request must be complete
    is_known = False  # whether the token was shown on this connection

    def setup(self) -> None:
        """Read by a clock: somebody who sends one byte at a time must not keep a place for long."""
        super().setup()
        self.rfile.close()
        self.rfile = io.BufferedReader(TimedReader(self))

    def handle_one_request(self) -> None:
        """Answer a request that comes in time."""
        self.deadline = time.monotonic() + (IDLE if self.is_known else HEAD)
        super().handle_one_request()

    def parse_request(self) -> bool:
        """Read the head of a request; what is none of HTTP/1 gets one refusal."""
        words = self.raw_requestline.split()
        if len(words) != 3 or not words[2].startswith(b"HTTP/1."):
            self.requestline, self.request_version, self.command = "", self.protocol_version, ""
            self.send_error(HTTPStatus.BAD_REQUEST)
            return False
        return super().parse_request()

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Refuse what is no request that is understood, in one line."""
        self.close_connection, self.request_version = True, self.protocol_version
        status = HTTPStatus(code)
        self.send(status, "text/plain; charset=utf-8", f"{status.phrase}\n".encode())

    def do_GET(self) -> None:  # noqa: N802 (the name that http.server calls)
        """Answer with the page, its files, frames and pictures."""
        self.answer(self.get)

    def do_POST(self) -> None:  # noqa: N802
        """Take events."""
        self.answer(self.post)

    def answer(self, method: Callable[[], None]) -> None:
        """Call a method; a refusal becomes an answer of its own."""
        try:
            method()
        except Refused as refusal:
            self.close_connection = True
            self.send(refusal.status, "text/plain; charset=utf-8", f"{refusal}\n".encode())
        except (ConnectionError, TimeoutError):
            self.close_connection = True

    def get(self) -> None:
        """Send the page, one of its files, a frame or a picture."""
        url = urlsplit(self.path)
        self.check_host()
        if url.path in PAGES:
            name, kind = PAGES[url.path]
            self.send(HTTPStatus.OK, kind, (FOLDER / name).read_bytes())
            return
        self.check_token()
        self.check_origin()
        if url.path == "/frame":
            self.send_frame(parse_qs(url.query))
        elif url.path.startswith("/picture."):
            self.send_picture(url.path.removeprefix("/picture."))
        else:
            raise Refused(HTTPStatus.NOT_FOUND, "there is no such page")

    def post(self) -> None:
        """Check the events of a request, and give them to the session."""
        self.check_host()
        self.check_token()
        self.check_origin()
        if urlsplit(self.path).path != "/event":
            raise Refused(HTTPStatus.NOT_FOUND, "there is no such page")
        if self.headers.get_content_type() != "application/json":
            raise Refused(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "events are JSON")
        size = self.headers.get("Content-Length", "")
        if not (size.isascii() and size.isdecimal()):
            raise Refused(HTTPStatus.LENGTH_REQUIRED, "a request must say its length")
        if len(size) > LONGEST_NUMBER or int(size) > MOST_BODY:
            raise Refused(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"a request has at most {MOST_BODY} bytes")
        try:
            events = json.loads(self.rfile.read(int(size)))
        except (ValueError, RecursionError):
            raise Refused(HTTPStatus.BAD_REQUEST, "this is no JSON") from None
        if not isinstance(events, list) or len(events) > MOST_EVENTS:
            raise Refused(HTTPStatus.BAD_REQUEST, f"events are a list of at most {MOST_EVENTS}")
        if not self.server.takes(len(events)):
            raise Refused(HTTPStatus.TOO_MANY_REQUESTS, f"at most {RATE} events per second")
        for event in events:
            try:
                self.server.session.post(event)
            except InputError as error:
                raise Refused(HTTPStatus.BAD_REQUEST, str(error)) from None
        self.send(HTTPStatus.NO_CONTENT, "text/plain", b"")

    def send_frame(self, given: dict[str, list[str]]) -> None:
        """The newest frame: the lengths of its state and of its details, both as JSON, and the file.

        The details are left out if the page has them already.
        """
        since, known = (whole_number(given, name) for name in ("since", "details"))
        end, frame = time.monotonic() + PATIENCE, None
        while frame is None and time.monotonic() < end and not self.server.session.is_over:
            frame = self.server.session.wait_for_frame(since, LOOK)
            if frame is None and self.is_gone():
                self.close_connection = True
                return
        if frame is None:
            self.send(HTTPStatus.NO_CONTENT, "text/plain", b"")
            return
        state, details = frame.state.encode(), b"" if frame.details_number == known else frame.details.encode()
        head = {"X-Frame": str(frame.number), "X-Kind": frame.kind, "X-Details": str(frame.details_number)}
        lengths = struct.pack("<II", len(state), len(details))
        self.send(HTTPStatus.OK, "application/octet-stream", lengths + state + details + frame.data_after(since), head)

    def is_gone(self) -> bool:
        """Whether the page has closed the connection while it waited: then its room is free for another one."""
        ready, _, _ = select.select([self.connection], [], [], 0)
        return bool(ready) and self.connection.recv(1, socket.MSG_PEEK) == b""

    def send_picture(self, kind: str) -> None:
        """The picture as a file."""
        session = self.server.session
        if kind not in FILES:
            raise Refused(HTTPStatus.NOT_FOUND, "there is no such page")
        try:
            data = session.call(lambda: session.file(kind))
        except InputError as error:
            raise Refused(HTTPStatus.CONFLICT, str(error)) from None
        except (CancelledError, FutureTimeout):
            raise Refused(HTTPStatus.SERVICE_UNAVAILABLE, "the program is busy, or ends") from None
        self.send(HTTPStatus.OK, FILES[kind], data, {"Content-Disposition": f"attachment; filename=picture.{kind}"})

    # ── who may ask ──

    def check_host(self) -> None:
        """Refuse names that lead here by another machine's name server."""
        if self.headers.get("Host", "") not in self.server.hosts:
            raise Refused(HTTPStatus.FORBIDDEN, "this name does not belong to the server")

    def check_origin(self) -> None:
        """Refuse requests that another page makes."""
        origin = self.headers.get("Origin")
        if origin is not None and origin not in {f"http://{host}" for host in self.server.hosts}:
            raise Refused(HTTPStatus.FORBIDDEN, "the request comes from another page")
        if self.headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin"):
            raise Refused(HTTPStatus.FORBIDDEN, "the request comes from another page")

    def check_token(self) -> None:
        """Refuse who does not know the token; who does keeps a place of the server's own."""
        token = self.headers.get(TOKEN, "").encode("utf-8", "replace")
        if not secrets.compare_digest(token, self.server.token.encode()):
            raise Refused(HTTPStatus.FORBIDDEN, "open the address that the terminal shows: it contains the token")
        if not self.is_known and not self.server.welcome(self.connection):
            raise Refused(HTTPStatus.SERVICE_UNAVAILABLE, f"at most {MOST_CONNECTIONS} connections at a time")
        self.is_known = True

    # ── answers ──

    def send(self, status: HTTPStatus, kind: str, body: bytes, more: dict[str, str] | None = None) -> None:
        """Send an answer: status, headers and body."""
        self.send_response(status)
        for name, value in {**HEADERS, "Content-Type": kind, "Content-Length": str(len(body)), **(more or {})}.items():
            self.send_header(name, value)
        if self.close_connection:
            self.send_header("Connection", "close")
        self.flush_with(body)

    def flush_with(self, body: bytes) -> None:
        """Send head and body in one piece: in two, the second one would wait until the first is acknowledged."""
        self._headers_buffer.append(b"\r\n" + body)
        self.flush_headers()

    def version_string(self) -> str:
        """What the server calls itself: it tells no version."""
        return "taichi_tracer"

    def log_message(self, *_arguments: Any) -> None:
        """Keep quiet."""


class TimedReader(io.RawIOBase):
    """The bytes of a connection, until the deadline of its handler."""

    def __init__(self, handler: Handler) -> None:
        super().__init__()
        self.handler = handler

    def readable(self) -> bool:
        """Yes."""
        return True

    def readinto(self, place: Any) -> int:
        """Read what has come; a TimeoutError if nothing comes in time."""
        left = self.handler.deadline - time.monotonic()
        if left <= 0:
            raise TimeoutError("the request is not complete in time")
        self.handler.connection.settimeout(left)
        try:
            return self.handler.connection.recv_into(place)
        finally:
            self.handler.connection.settimeout(IDLE)


def whole_number(given: dict[str, list[str]], name: str) -> int:
    """The number that a query gives by name; 0 if it gives none."""
    text = given.get(name, ["0"])[0]
    if not (text.isascii() and text.isdecimal()) or len(text) > LONGEST_NUMBER:
        raise Refused(HTTPStatus.BAD_REQUEST, f"{name} must be a whole number")
    return int(text)


class Server(socketserver.ThreadingMixIn, http.server.HTTPServer):
    """The server of one session.

    Attributes:
        token: what every request must carry. hosts: the values of Host that are answered.
    """

    daemon_threads = True
    block_on_close = False
    allow_reuse_address = False
    request_queue_size = 32

    def __init__(self, session: Session, port: int, forwarded: Sequence[int] = ()) -> None:
        super().__init__((LOOPBACK, port), Handler)
        self.session, self.token = session, secrets.token_urlsafe(24)
        self.hosts = {f"{name}:{one}" for name in (LOOPBACK, "localhost") for one in (self.server_port, *forwarded)}
        # The connections that are open: of who has not shown the token, in the order in which they came, and of others.
        self._strangers: dict[socket.socket, None] = {}
        self._guests: set[socket.socket] = set()
        self._doors = threading.Lock()
        self._second, self._events, self._counting = 0, 0, threading.Lock()

    @property
    def address(self) -> str:
        """What a browser opens."""
        return f"http://{LOOPBACK}:{self.server_port}/#token={self.token}"

    def takes(self, events: int) -> bool:
        """Whether so many more events are within the rate."""
        with self._counting:
            second = int(time.monotonic())
            if second != self._second:
                self._second, self._events = second, 0
            self._events += events
            return self._events <= RATE

    def welcome(self, connection: socket.socket) -> bool:
        """Give a place to a connection on which the token was shown; False if there is none."""
        with self._doors:
            if len(self._guests) >= MOST_CONNECTIONS:
                return False
            self._strangers.pop(connection, None)
            self._guests.add(connection)
            return True

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer in a thread of its own. If there are too many strangers, the one who came first has to leave."""
        with self._doors:
            first = next(iter(self._strangers)) if len(self._strangers) >= MOST_CONNECTIONS else None
            self._strangers.pop(first, None)  # type: ignore[arg-type]
            self._strangers[request] = None
        if first is not None:
            with contextlib.suppress(OSError):
                first.shutdown(socket.SHUT_RDWR)  # its thread sees the end, and closes it
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        """Close a connection, and give its place back."""
        with self._doors:
            self._strangers.pop(request, None)
            self._guests.discard(request)
        super().shutdown_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Keep quiet about connections that break."""
        if not isinstance(sys.exc_info()[1], ConnectionError | TimeoutError):
            super().handle_error(request, client_address)


def open_server(session: Session, forwarded: Sequence[int] = ()) -> Server:
    """A server on the first free port.

    Args:
        forwarded: ports of other machines that lead here, by which a browser may ask, too.

    Raises:
        InputError: none is free.
    """
    for port in range(FIRST_PORT, LAST_PORT + 1):
        try:
            return Server(session, port, forwarded)
        except OSError:
            continue
    raise InputError(f"browser: no port from {FIRST_PORT} to {LAST_PORT} is free on {LOOPBACK}")


def serve(session: Session, tell: Callable[[str], None] = print, forwarded: Sequence[int] = ()) -> int:
    """Serve until Ctrl-C; ``forwarded`` as for ``open_server``."""
    session.warm_up(tell)
    server = open_server(session, forwarded)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.2}, daemon=True)
    thread.start()
    tell(f"Open {server.address}")
    tell(
        f"From another machine, first: ssh -N -L {server.server_port}:{LOOPBACK}:{server.server_port} "
        f"USER@{socket.gethostname()}"
    )
    tell("Ctrl-C ends it.")
    try:
        while True:
            session.step()
    except KeyboardInterrupt:
        return 0
    finally:
        session.close()
        server.shutdown()
        server.server_close()
        thread.join()
