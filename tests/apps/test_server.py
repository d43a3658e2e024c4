"""The server answers who knows the token, on this machine and from its own page; it refuses everything else."""

import contextlib
import http.client
import json
import socket
import struct
import threading

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from taichi_tracer.apps.page import server as module
from taichi_tracer.apps.page.channel import Frame
from taichi_tracer.apps.page.server import LiveServer, open_server


class Watchers(list):
    """Pages that get one frame at once."""

    def append(self, page):
        super().append(page)
        page.show(Frame(3, "png", b"picture", {"a": 1}))


class Watched:
    """A session without a renderer, which has one frame."""

    def __init__(self):
        self.events, self.watchers = [], Watchers()

    def add(self, kind, members):
        self.events.append((kind, members))
        if kind == "save":
            members["watcher"].send({"file": f"picture.{members['kind']}"}, b"file")


@pytest.fixture
def server():
    found = open_server(Watched())
    yield found
    found.close()


def ask(server, path="/", **headers):
    """(status, headers, body) of a page; the right Host unless another is given."""
    given = {"Host": f"127.0.0.1:{server.port}"} | {name.replace("_", "-"): value for name, value in headers.items()}
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=5)
    connection.putrequest("GET", path, skip_host=True)
    for name, value in given.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read()
    connection.close()
    return found


@contextlib.contextmanager
def opened(server, token=None, **options):
    """A WebSocket on which the token was shown."""
    options = {"origin": f"http://127.0.0.1:{server.port}", "compression": None} | options
    with connect(f"ws://127.0.0.1:{server.port}/socket", **options) as found:
        found.send(server.token if token is None else token)
        yield found


def received(connection):
    """(state, file) of the next message."""
    data = connection.recv(5)
    (length,) = struct.unpack("<I", data[:4])
    return json.loads(data[4 : 4 + length]), data[4 + length :]


def test_the_page_and_its_files_need_nothing_from_elsewhere(server):
    total = 0
    for path in module.PAGES:
        status, headers, body = ask(server, path)
        assert status == 200
        assert b"://" not in body.replace(b"ws://${location.host}", b"")
        assert headers["Content-Security-Policy"].startswith("default-src 'none'")
        assert headers["Cache-Control"] == "no-store"
        assert "Access-Control-Allow-Origin" not in headers
        assert headers["Server"] == "taichi_tracer"
        assert server.token.encode() not in body
        total += len(body)
    assert total < 60_000


def test_frames_are_sent_and_events_are_taken(server):
    with opened(server) as page:
        state, data = received(page)
        assert state == {"a": 1, "id": 3, "kind": "png", "lost": ""}
        assert data == b"picture"
        page.send(json.dumps({"type": "ack", "id": 3}))
        page.send(json.dumps({"type": "point", "column": 1, "row": 0}))
        page.send(json.dumps({"type": "save", "kind": "png"}))
        assert received(page) == ({"file": "picture.png"}, b"file")
    assert ("point", {"column": 1, "row": 0}) in server.session.events


@pytest.mark.parametrize(
    "message",
    [
        *("no json", "[" * 20_000, "[]", '{"type": "fov", "value": 1e999}', '{"type": "save", "kind": "/etc/passwd"}'),
        '{"type": "compare", "side": 1%s}' % ("0" * 400),
        '{"type": "point", "column": 1%s}' % ("0" * 5000),
    ],
)
def test_what_is_wrong_is_answered_with_one_line_and_the_page_goes_on(server, message):
    with opened(server) as page:
        received(page)
        page.send(message)
        state, _ = received(page)
        assert 0 < len(state["message"]) < 200
        page.send(json.dumps({"type": "reset"}))
        page.send(json.dumps({"type": "save", "kind": "exr"}))
        assert received(page)[0] == {"file": "picture.exr"}


@pytest.mark.parametrize("token", ["", "wrong", "\xe9", b"bytes"])
def test_without_the_token_nothing_is_sent(server, token):
    with opened(server, token) as page, pytest.raises(ConnectionClosed, match="contains the token"):
        page.recv(5)
    assert server.session.events == []


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example:8765"}, 403),
        ({"Sec_Fetch_Site": "cross-site"}, 403),
        ({"path": "/../pyproject.toml"}, 404),
        ({"path": "/live/../../__init__.py"}, 404),
    ],
)
def test_other_pages_and_files_are_refused(server, headers, status):
    assert ask(server, **headers)[0] == status


@pytest.mark.parametrize("origin", ["http://evil.example", "null"])
def test_the_socket_is_closed_to_other_pages(server, origin):
    with pytest.raises(InvalidStatus, match="403"), opened(server, origin=origin):
        pass


def closed_with(page):
    """The code with which the server closes a connection."""
    with contextlib.suppress(ConnectionClosed):
        for _ in range(100):
            page.recv(5)
    return page.close_code


def test_limits_of_size_time_and_number(server, monkeypatch):
    with opened(server) as page:
        received(page)
        page.send("x" * (module.MOST_BYTES + 1))
        assert closed_with(page) == 1009
    with contextlib.ExitStack() as pages:
        for _ in range(module.MOST_CONNECTIONS):
            received(pages.enter_context(opened(server)))
        with opened(server) as late, pytest.raises(ConnectionClosed, match="at most 24 connections"):
            late.recv(5)
    monkeypatch.setattr(module, "PATIENCE", 0.2)
    address = f"127.0.0.1:{server.port}"
    with connect(f"ws://{address}/socket", origin=f"http://{address}") as silent, pytest.raises(ConnectionClosed):
        silent.recv(5)


def test_it_listens_on_this_machine_alone_and_leaves_no_thread():
    before = threading.active_count()
    for _ in range(5):
        found = LiveServer(Watched(), 0)
        assert ask(found)[0] == 200
        with opened(found):
            found.close()
    assert threading.active_count() <= before + 1
    with pytest.raises(OSError, match=r"refused|failed|unreachable"):
        socket.create_connection((socket.gethostbyname(socket.gethostname()), found.port), 1)
