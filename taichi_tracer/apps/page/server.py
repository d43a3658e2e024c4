"""Serves a picture to a browser on this machine: the page, and one WebSocket for frames and events.

The library ``websockets`` limits the size of messages and the time of a request, checks Origin, and notices connections
that are gone. The first message of a connection is the token that the terminal printed; without it, nothing is sent.
docs/browser.md says what is protected from whom.
"""

import contextlib
import json
import logging
import secrets
import socket
import struct
import threading
from collections.abc import Sequence
from functools import partial
from http import HTTPStatus
from pathlib import Path
from typing import Any

from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import ServerConnection
from websockets.sync.server import serve as serve_sockets

from taichi_tracer.apps.page.channel import Watcher
from taichi_tracer.apps.page.session import Session
from taichi_tracer.system.errors import InputError

LOOPBACK = "127.0.0.1"
FIRST_PORT, LAST_PORT = 8765, 8865  # the server listens on the first free one
MOST_BYTES = 64 * 1024  # of a message
MOST_CONNECTIONS = 24  # at the same time, of those who have shown the token
PATIENCE = 3.0  # seconds in which a connection must be opened, and in which the token must come
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
SOCKET = "/socket"
FOLDER = Path(__file__).parent
QUIET = logging.getLogger("taichi_tracer.page")  # who sends what is no request is refused in silence
QUIET.disabled = True


class LiveServer:
    """The server of one session; it runs in threads of its own until ``close``.

    Args:
        forwarded: ports of other machines that lead here, by which a browser may ask, too.

    Attributes:
        token: the first message of each connection. address: what a browser opens.

    Raises:
        OSError: the port is not free.
    """

    def __init__(self, session: Session, port: int, forwarded: Sequence[int] = ()) -> None:
        self.session, self.token = session, secrets.token_urlsafe(24)
        listening = socket.create_server((LOOPBACK, port))
        self.port = listening.getsockname()[1]
        self.address = f"http://{LOOPBACK}:{self.port}/#token={self.token}"
        self.hosts = {f"{name}:{one}" for name in (LOOPBACK, "localhost") for one in (self.port, *forwarded)}
        self._connections: set[ServerConnection] = set()
        self._server = serve_sockets(
            self.talk,
            sock=listening,
            origins=[f"http://{host}" for host in self.hosts],
            process_request=self.page,
            server_header="taichi_tracer",
            max_size=MOST_BYTES,
            open_timeout=PATIENCE,
            compression=None,
            logger=QUIET,
        )
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End all connections; before version 17, ``shutdown`` leaves them open."""
        for connection in [*self._connections]:
            connection.close(1001)
        self._server.shutdown()
        self._thread.join()

    def page(self, connection: ServerConnection, request: Request) -> Response | None:
        """The page or one of its files; None lets a WebSocket open.

        Names that lead here by another machine's name server are refused, and so is what another page asks for.
        """
        host, site = request.headers.get("Host", ""), request.headers.get("Sec-Fetch-Site", "none")
        if host not in self.hosts or site not in ("none", "same-origin"):
            return answer(HTTPStatus.FORBIDDEN, b"the request comes from another page\n")
        if request.path == SOCKET:
            return None
        if request.path not in PAGES:
            return answer(HTTPStatus.NOT_FOUND, b"there is no such page\n")
        name, kind = PAGES[request.path]
        return answer(HTTPStatus.OK, (FOLDER / name).read_bytes(), kind)

    def talk(self, connection: ServerConnection) -> None:
        """Take the token, and then events, until one of both ends."""
        with contextlib.suppress(ConnectionClosed, TimeoutError):
            token = connection.recv(PATIENCE)
            if not isinstance(token, str) or not secrets.compare_digest(token.encode(), self.token.encode()):
                connection.close(1008, "open the address that the terminal shows: it contains the token")
            elif len(self._connections) >= MOST_CONNECTIONS:
                connection.close(1013, f"at most {MOST_CONNECTIONS} connections at a time")
            else:
                self.take_events(connection)

    def take_events(self, connection: ServerConnection) -> None:
        """Give the events of a page to the session, and say of each message what is wrong with it."""
        watcher = Watcher(self.session, partial(send, connection))
        self._connections.add(connection)
        self.session.watchers.append(watcher)
        try:
            for message in connection:
                try:
                    watcher.post(json.loads(message))
                except InputError as error:
                    watcher.send({"message": str(error)}, b"")
                except (ValueError, RecursionError):
                    watcher.send({"message": "this is no JSON"}, b"")
        finally:
            self.session.watchers.remove(watcher)
            self._connections.remove(connection)


def send(connection: ServerConnection, state: dict[str, Any], data: bytes) -> None:
    """Send the length of a state, the state as JSON, and a file; nothing if the page is closed."""
    text = json.dumps(state).encode()
    with contextlib.suppress(ConnectionClosed):
        connection.send(struct.pack("<I", len(text)) + text + data)


def answer(status: HTTPStatus, body: bytes, kind: str = "text/plain; charset=utf-8") -> Response:
    """An answer of HTTP."""
    headers = {**HEADERS, "Content-Type": kind, "Content-Length": str(len(body)), "Connection": "close"}
    return Response(status.value, status.phrase, Headers(headers), body)


def open_server(session: Session, forwarded: Sequence[int] = ()) -> LiveServer:
    """A server on the first free port; ``forwarded`` as for ``LiveServer``.

    Raises:
        InputError: none is free.
    """
    for port in range(FIRST_PORT, LAST_PORT + 1):
        with contextlib.suppress(OSError):
            return LiveServer(session, port, forwarded)
    raise InputError(f"browser: no port from {FIRST_PORT} to {LAST_PORT} is free on {LOOPBACK}")


def serve(session: Session, forwarded: Sequence[int] = ()) -> int:
    """Compile the first picture, and serve until Ctrl-C; ``forwarded`` as for ``LiveServer``."""
    session.warm_up()
    server = open_server(session, forwarded)
    print(f"Open {server.address}")
    print(f"From another machine, first: ssh -N -L {server.port}:{LOOPBACK}:{server.port} USER@{socket.gethostname()}")
    print("Ctrl-C ends it.")
    try:
        while True:
            session.step()
    except KeyboardInterrupt:
        return 0
    finally:
        server.close()
