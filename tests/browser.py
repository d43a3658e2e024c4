"""A real browser without a window, for pages: it takes orders through a pipe, by the protocol of its own tools."""

import contextlib
import fcntl
import itertools
import json
import os
import select
import shutil
import subprocess
import time
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FIRST_FREE = 20  # descriptors below are left to Python; the browser gets 3 and 4
SECONDS = 120.0


def path_of_browser() -> str | None:
    """The program; None where there is none."""
    return next((found for name in NAMES if (found := shutil.which(name))), None)


@contextlib.contextmanager
def started(folder: Path):
    """A browser with an empty profile in a folder; the test is skipped where there is none."""
    program = path_of_browser()
    if program is None:
        pytest.skip(f"there is no browser: none of {', '.join(NAMES)} is installed")
    shown = Browser(program, folder)
    try:
        yield shown
    finally:
        shown.end()


class Browser:
    """One page in a browser, what its scripts complain about, and what it asks the network for.

    Attributes:
        complaints: messages of errors and warnings on the console, and of exceptions, since the last ``open``.
        requests: the addresses that were asked for, without those of data in the page.
    """

    def __init__(self, program: str, folder: Path) -> None:
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD, FIRST_FREE) for end in (*os.pipe(), *os.pipe())]
        commands, self._out, self._in, answers = ends

        def give_pipes() -> None:
            os.dup2(commands, 3)
            os.dup2(answers, 4)

        words = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
        words += ["--hide-scrollbars", f"--user-data-dir={folder / 'profile'}", "--remote-debugging-pipe"]
        self._process = subprocess.Popen(
            [program, *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            preexec_fn=give_pipes,
            pass_fds=(3, 4),
        )
        for descriptor in (commands, answers):
            os.close(descriptor)
        self._numbers, self._rest, self._session = itertools.count(1), b"", None
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self._loaded = False
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

    def ask(self, method: str, **parameters) -> dict:
        """Give one command, and wait for its result."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while True:
            told = self._next()
            if told.get("id") == number:
                assert "error" not in told, told
                return told["result"]

    def open(self, url: str, width: int = 1280, height: int = 900, scheme: str = "light") -> None:
        """Load a page, and wait until it is there.

        Args:
            width, height: of the window, in pixels. scheme: "light" or "dark".
        """
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.ask("Emulation.setDeviceMetricsOverride", **size)
        wish = [{"name": "prefers-color-scheme", "value": scheme}]
        self.ask("Emulation.setEmulatedMedia", media="screen", features=wish)
        self.complaints, self.requests, self._loaded = [], [], False
        self.ask("Page.navigate", url=url)
        while not self._loaded:
            self._next()

    def evaluate(self, script: str) -> object:
        """The value of an expression of JavaScript in the page."""
        told = self.ask("Runtime.evaluate", expression=script, returnByValue=True)
        assert "exceptionDetails" not in told, told
        return told["result"].get("value")

    def _next(self) -> dict:
        """The next message of the browser; what it tells by itself is kept."""
        deadline = time.monotonic() + SECONDS
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._in], [], [], max(0.0, deadline - time.monotonic()))
            data = os.read(self._in, 1 << 16) if ready else b""
            if not data:
                pytest.fail("the browser does not answer")
            self._rest += data
        text, _, self._rest = self._rest.partition(b"\0")
        told = json.loads(text)
        self._note(told.get("method"), told.get("params", {}))
        return told

    def _note(self, method: str | None, facts: dict) -> None:
        if method == "Page.loadEventFired":
            self._loaded = True
        elif method == "Network.requestWillBeSent" and not facts["request"]["url"].startswith("data:"):
            self.requests.append(facts["request"]["url"])
        elif method == "Log.entryAdded" and facts["entry"]["level"] in ("error", "warning"):
            self.complaints.append(facts["entry"]["text"])
        elif method == "Runtime.consoleAPICalled" and facts["type"] in ("error", "warning", "assert"):
            self.complaints.append(str(facts["args"]))
        elif method == "Runtime.exceptionThrown":
            self.complaints.append(facts["exceptionDetails"]["text"])

    def end(self) -> None:
        """Close the browser."""
        with contextlib.suppress(OSError):
            os.close(self._out)
        os.close(self._in)
        self._process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=5)
        self._process.kill()
        self._process.wait()
