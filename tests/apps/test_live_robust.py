"""The live page under load: nothing that pages, connections or users do ends the renderer, or leaks anything.

One program serves all of these tests, in a process of its own; its threads, sockets and memory are read from /proc.
"""

import contextlib
import http.client
import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.exhaustive,
    pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the figures are read from /proc"),
]
PATIENCE = 90.0  # seconds
SIZE = (64, 48)
JSON = {"Content-Type": "application/json"}


class Program:
    """``taichi-tracer view --browser`` in a process of its own."""

    def __init__(self, *words):
        command = [sys.executable, "-m", "taichi_tracer", "view", *words, "--browser"]
        environment = os.environ | {"PYTHONUNBUFFERED": "1"}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        self.process = subprocess.Popen(command, env=environment, **pipes)
        self.told = ""
        for line in self.process.stdout:
            self.told += line
            if found := re.search(r"http://127.0.0.1:(\d+)/#token=(\S+)", line):
                self.port, self.token = int(found[1]), found[2]
                return
        pytest.fail(self.told)

    def connect(self):
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)

    def ask(self, path, method="GET", body=None, connection=None, **headers):
        """(status, headers, body)."""
        own = self.connect() if connection is None else connection
        given = {"X-Token": self.token} | headers
        own.request(method, path, body, given)
        answer = own.getresponse()
        found = answer.status, answer.headers, answer.read()
        if connection is None:
            own.close()
        return found

    def post(self, *events):
        return self.ask("/event", "POST", json.dumps(events), **JSON)[0]

    def frame(self, since=0, connection=None):
        """(number, kind, state with details, file) of the next frame; None if none comes in time."""
        status, headers, body = self.ask(f"/frame?since={since}", connection=connection)
        if status == 204:
            return None
        assert status == 200, body
        a, b = struct.unpack("<II", body[:8])
        state = json.loads(body[8 : 8 + a]) | json.loads(body[8 + a : 8 + a + b])
        return int(headers["X-Frame"]), headers["X-Kind"], state, body[8 + a + b :]

    def rest(self, check=lambda state: True):
        """The first lossless frame whose state passes a check."""
        end, since = time.monotonic() + PATIENCE, 0
        while time.monotonic() < end:
            found = self.frame(since)
            if found is not None:
                since = found[0]
                if found[1] == "png" and check(found[2]):
                    return found
        pytest.fail("the picture did not come to rest")

    def figures(self):
        """Threads, sockets and kilobytes of memory of the process."""
        folder = Path(f"/proc/{self.process.pid}")
        status = dict(line.split(":", 1) for line in (folder / "status").read_text().splitlines())
        links = [os.readlink(one) for one in (folder / "fd").iterdir() if one.is_symlink()]
        sockets = sum(link.startswith("socket:") for link in links)
        return int(status["Threads"]), sockets, int(status["VmRSS"].split()[0])

    def end(self):
        self.process.send_signal(signal.SIGINT)
        rest = self.process.communicate(timeout=PATIENCE)[0]
        assert "Traceback" not in rest, rest
        assert self.process.returncode in (0, 130, -signal.SIGINT)  # the last: while a kernel is compiled


@pytest.fixture(scope="module")
def program():
    found = Program("cube", "--size", f"{SIZE[0]}x{SIZE[1]}", "--view", "normal")
    yield found
    found.end()


@pytest.fixture(autouse=True)
def alive(program):
    """After each test the program shows its picture as before."""
    yield
    assert program.process.poll() is None
    assert program.post({"type": "use", "what": "view", "name": "normal"}, {"type": "reset"}, {"type": "blur"}) == 204
    program.rest(lambda state: state["view"] == "normal")


def test_two_hundred_pages_leave_nothing_behind(program):
    def open_and_close(k):
        connection = program.connect()
        for path in ("/", "/live.js", "/host.js", "/live.css"):
            assert program.ask(path, connection=connection)[0] == 200
        assert program.frame(0, connection) is not None
        program.post({"type": "drag", "dx": 0.01 * (-1) ** k, "dy": 0})
        if k % 2:  # half of the pages are closed while they wait for a frame
            connection.request("GET", "/frame?since=999999999", headers={"X-Token": program.token})
        connection.close()

    for k in range(20):
        open_and_close(k)
    time.sleep(12)
    before = program.figures()
    for k in range(200):
        open_and_close(k)
    time.sleep(12)  # a request that nobody waits for ends after ten seconds
    after = program.figures()
    print(f"threads, sockets, KB: {before} before, {after} after 200 pages")
    assert after[0] <= before[0] + 1
    assert after[1] <= before[1] + 1
    assert after[2] < before[2] + 8 * 1024


def test_a_slow_link_gets_few_frames_and_no_old_ones(program):
    stop = threading.Event()

    def drag():
        k = 0
        while not stop.is_set():
            k += 1
            program.post({"type": "drag", "dx": 0.002, "dy": 0}, {"type": "fov", "value": 30 + k % 40})
            time.sleep(0.02)

    thread = threading.Thread(target=drag)
    thread.start()
    try:
        seen, since = [], program.frame()[0]
        for _ in range(6):
            time.sleep(0.5)  # the link
            found = program.frame(since)
            seen.append(found[0] - since)
            since = found[0]
        assert max(seen) <= 3, f"frames were made that nobody took: {seen}"
    finally:
        stop.set()
        thread.join()
    program.post({"type": "fov", "value": 40})
    assert program.rest(lambda state: state["fov"] == 40)[2]["fov"] == 40  # the newest, soon


def test_ten_thousand_events_a_second_are_refused_and_survived(program):
    before = program.figures()[2]
    body = json.dumps([{"type": "drag", "dx": 1e-4, "dy": 0}] * 250)
    connection, statuses = program.connect(), []
    end = time.monotonic() + 3
    while time.monotonic() < end:
        for _ in range(4):
            status, headers, _ = program.ask("/event", "POST", body, connection, **JSON)
            statuses.append(status)
            if status != 204:
                connection.close()
                connection = program.connect()
        time.sleep(0.05)
    assert set(statuses) == {204, 429}
    time.sleep(1.1)
    assert program.post({"type": "reset"}) == 204
    assert program.figures()[2] < before + 8 * 1024


def test_malformed_events_are_answered_in_one_line(program):
    for text in (
        b"",
        b"{",
        b"[null]",
        b'[{"type": "fov"}]',
        b'[{"type": "key", "key": "\\u0000", "down": true}]',
        b"[1e400]",
    ):
        status, _, body = program.ask("/event", "POST", text, **JSON)
        assert status == 400
        assert body.count(b"\n") == 1
    for raw in (
        b"GET / HTTP/1.1\r\n\r\n",
        b"\x16\x03\x01" * 9,
        b"POST /event HTTP/1.1\r\nContent-Length: 9\r\n",
        b"GET " + b"x" * 70000,
    ):
        with socket.create_connection(("127.0.0.1", program.port), 5) as connection:
            connection.sendall(raw)
            connection.shutdown(socket.SHUT_WR)
            connection.settimeout(5)
            assert b"Traceback" not in connection.recv(4096)


def test_tabs_share_one_picture_and_one_may_close(program):
    first, second = program.connect(), program.connect()
    a, b = program.frame(0, first), program.frame(0, second)
    assert a[3] == b[3]
    second.close()
    program.post({"type": "use", "what": "view", "name": "hit"})
    assert program.rest(lambda state: state["view"] == "hit")[2]["view"] == "hit"
    assert program.frame(0, first)[2]["offered"]  # a reload gets everything again
    first.close()


def test_two_programs_have_ports_of_their_own(program):
    other = Program("cube", "--size", "8x8", "--view", "hit")
    try:
        assert other.port != program.port
        assert other.ask("/picture.png", **{"X-Token": program.token})[0] == 403
        assert other.rest()[2]["view"] == "hit"
    finally:
        other.end()


def test_ctrl_c_while_frames_are_waited_for_and_a_kernel_is_compiled():
    other = Program("cube", "--size", "32x24", "--view", "hit")
    threads = [threading.Thread(target=lambda: ignoring(lambda: other.frame(10**9))) for _ in range(5)]
    for thread in threads:
        thread.start()
    other.post({"type": "use", "what": "path", "name": "path"})
    time.sleep(0.5)
    begin = time.monotonic()
    other.end()
    assert time.monotonic() - begin < 30
    for thread in threads:
        thread.join(10)
        assert not thread.is_alive()


def ignoring(call):
    with contextlib.suppress(OSError, http.client.HTTPException):
        call()


def test_a_large_picture_is_sent_and_moves():
    other = Program("cube", "--size", "4096x4096", "--view", "normal")
    try:
        _, _, state, data = other.rest()
        assert (state["width"], state["height"]) == (4096, 4096)
        assert data.startswith(b"\x89PNG")
        assert struct.unpack(">II", data[16:24]) == (4096, 4096)
        since, kinds = other.frame()[0], []
        for _ in range(5):
            other.post({"type": "drag", "dx": 0.01, "dy": 0})
            while (found := other.frame(since)) is None:
                pass
            since = found[0]
            kinds.append((found[1], len(found[3])))
        moving = [size for kind, size in kinds if kind == "jpeg"]
        assert len(moving) >= 2
        assert max(moving) < 1 << 20
    finally:
        other.end()
