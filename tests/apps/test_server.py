"""The server answers who knows the token, on this machine and from its own page; it refuses everything else."""

import http.client
import json
import socket
import struct
import threading

import pytest

from taichi_tracer.apps import server as module
from taichi_tracer.apps.events import checked
from taichi_tracer.apps.frames import Frame
from taichi_tracer.apps.server import Server, open_server


class Watched:
    """A session without a renderer."""

    def __init__(self):
        self.events, self.is_over = [], False

    def post(self, event):
        self.events.append(checked(event))

    def wait_for_frame(self, since, patience):
        return Frame(3, "png", b"picture", '{"a": 1}', '{"b": 2}', 7, 2) if since < 3 else None

    def call(self, function, patience=1.0):
        return function()

    def file(self, kind):
        return b"file"


@pytest.fixture
def server():
    found = open_server(Watched())
    thread = threading.Thread(target=found.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
    thread.start()
    yield found
    found.shutdown()
    found.server_close()
    thread.join(5)


def ask(server, method="GET", path="/", body=None, **headers):
    """(status, headers, body); the right Host and token unless others are given."""
    port = server.server_port
    given = {"Host": f"127.0.0.1:{port}", "X-Token": server.token}
    given |= {name.replace("_", "-"): value for name, value in headers.items()}
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
    connection.putrequest(method, path, skip_host=True)
    for name, value in {k: v for k, v in given.items() if v is not None}.items():
        connection.putheader(name, value)
    if body is not None and "Content-Length" not in given:
        connection.putheader("Content-Length", str(len(body)))
    connection.endheaders(body)
    answer = connection.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read()
    connection.close()
    return found


JSON = {"Content_Type": "application/json"}


def test_the_page_and_its_files_need_nothing_from_elsewhere(server):
    total = 0
    for path in module.PAGES:
        status, headers, body = ask(server, path=path)
        assert status == 200
        assert b"://" not in body.replace(b"http://127", b"")
        assert headers["Content-Security-Policy"].startswith("default-src 'none'")
        assert headers["Cache-Control"] == "no-store"
        assert "Access-Control-Allow-Origin" not in headers
        assert headers["Server"] == "taichi_tracer"
        total += len(body)
    assert total < 60_000


def test_frames_have_their_state_before_the_file(server, monkeypatch):
    monkeypatch.setattr(module, "PATIENCE", 0.05)
    status, headers, body = ask(server, path="/frame?since=1")
    length, more = struct.unpack("<II", body[:8])
    assert (status, headers["X-Frame"], headers["X-Kind"], headers["X-Details"]) == (200, "3", "png", "7")
    assert json.loads(body[8 : 8 + length]) == {"a": 1}
    assert json.loads(body[8 + length : 8 + length + more]) == {"b": 2}
    assert body[8 + length + more :] == b"picture"
    assert ask(server, path="/frame?since=2&details=7")[2] == struct.pack("<II", length, 0) + b'{"a": 1}'
    assert ask(server, path="/frame?since=1&details=7")[2] == struct.pack("<II", length, 0) + b'{"a": 1}picture'
    assert ask(server, path="/frame?since=3")[0] == 204
    assert ask(server, path="/picture.png")[2] == b"file"


def test_events_are_taken(server):
    body = json.dumps([{"type": "drag", "dx": 0.1, "dy": 0}, {"type": "reset"}]).encode()
    assert ask(server, "POST", "/event", body, **JSON)[0] == 204
    assert server.session.events == [("drag", {"dx": 0.1, "dy": 0.0}), ("reset", {})]


@pytest.mark.parametrize(
    ("request_of", "status"),
    [
        ({"path": "/frame", "X_Token": None}, 403),
        ({"path": "/frame", "X_Token": "wrong"}, 403),
        ({"path": "/frame", "X_Token": "\xe9"}, 403),
        ({"path": "/picture.png", "X_Token": None}, 403),
        ({"method": "POST", "path": "/event", "body": b"[]", "X_Token": None, **JSON}, 403),
        ({"Host": "evil.example:8765"}, 403),
        ({"Host": None}, 403),
        ({"path": "/frame", "Origin": "http://evil.example"}, 403),
        ({"path": "/frame", "Origin": "null"}, 403),
        ({"path": "/frame", "Sec_Fetch_Site": "cross-site"}, 403),
        ({"path": "/../pyproject.toml"}, 404),
        ({"path": "/live/../../__init__.py"}, 404),
        ({"path": "/frame?since=-1"}, 400),
        ({"path": "/frame?since=0&details=x"}, 400),
        ({"path": "/frame?since=%C2%B2"}, 400),
        ({"path": "/picture.gif"}, 404),
        ({"path": "/picture./etc/passwd"}, 404),
        ({"path": "/frame?since=" + "9" * 40}, 400),
        ({"method": "POST", "path": "/event", "body": b"[]"}, 415),
        ({"method": "POST", "path": "/event", "body": b"[]", "Content_Type": "text/plain"}, 415),
        ({"method": "POST", "path": "/elsewhere", "body": b"[]", **JSON}, 404),
        ({"method": "POST", "path": "/event", "body": b"no json", **JSON}, 400),
        ({"method": "POST", "path": "/event", "body": b"{}", **JSON}, 400),
        ({"method": "POST", "path": "/event", "body": b"[" * 20_000, **JSON}, 400),
        ({"method": "POST", "path": "/event", "body": b'[{"type": "fov", "value": 1e999}]', **JSON}, 400),
        ({"method": "POST", "path": "/event", "body": b"[" + b"{}," * 400 + b"{}]", **JSON}, 400),
        ({"method": "POST", "path": "/event", "Content_Length": "100000000", **JSON}, 413),
        ({"method": "POST", "path": "/event", "Content_Length": "x", **JSON}, 411),
        ({"method": "POST", "path": "/event", "Content_Length": "9" * 5000, **JSON}, 413),
        (
            {
                "method": "POST",
                "path": "/event",
                "body": b'[{"type": "drag", "dx": 1%s, "dy": 0}]' % (b"0" * 400),
                **JSON,
            },
            400,
        ),
        ({"method": "POST", "path": "/event", "body": b'[{"type": "zoom", "by": 1%s}]' % (b"0" * 5000), **JSON}, 400),
        ({"method": "POST", "path": "/event", "body": b"[]", "Origin": "http://evil.example", **JSON}, 403),
        ({"method": "PUT", "path": "/event", "body": b"[]"}, 501),
    ],
)
def test_everything_else_is_refused(server, request_of, status):
    found, _, body = ask(server, **request_of)
    assert found == status
    assert server.token.encode() not in body
    assert server.session.events == []


def test_it_listens_on_this_machine_alone(server):
    assert server.server_address[0] == "127.0.0.1"


@pytest.mark.parametrize(
    "line",
    [
        b"GET /\r\n",
        b"GET / HTTP/0.9\r\n\r\n",
        b"GARBAGE\r\n\r\n",
        b"\x16\x03\x01 a b c d\r\n",
        b"GET / HTTP/1.x\r\n\r\n",
    ],
)
def test_what_is_no_request_gets_one_refusal(server, line, capfd):
    with socket.create_connection(("127.0.0.1", server.server_port), 5) as connection:
        connection.sendall(line)
        answer = b""
        while more := connection.recv(1 << 16):
            answer += more
    assert answer.startswith(b"HTTP/1.1 400 Bad Request\r\n")
    assert answer.endswith(b"\r\n\r\nBad Request\n")
    assert answer.count(b"HTTP/1.1") == 1
    assert capfd.readouterr().err == ""


def test_a_server_that_ends_leaves_no_thread():
    before = threading.active_count()
    for _ in range(20):
        found = Server(Watched(), 0)
        thread = threading.Thread(target=found.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        assert ask(found)[0] == 200
        found.shutdown()
        found.server_close()
        thread.join(5)
    assert threading.active_count() <= before + 1
