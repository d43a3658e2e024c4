"""The page in a browser: it is opened, turned, another view is chosen, a pixel is explained, and it is closed."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import browser
import pytest

import taichi_tracer as tt

CANVAS = "document.querySelector('canvas')"
PIXELS = f"""(() => {{ const c = {CANVAS};
  return Array.from(c.getContext("2d").getImageData(0, 0, c.width, c.height).data).join(); }})()"""
CLICK = "(() => {{ const b = [...document.querySelectorAll('button')].find(b => b.textContent.startsWith('{}'));"
CLICK += " if (b) b.click(); return Boolean(b); }})()"


def until(condition, what):
    """Wait for a condition, a minute at most."""
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.2)


BORDER = "document.querySelector('.tt-border').value"
BOX = "(() => {{ const b = document.querySelector('{}').getBoundingClientRect();"
BOX += " return [b.left, b.top, b.right, b.bottom]; }})()"


class Page:
    """The page of ``view --browser`` in a browser."""

    def __init__(self, shown, address):
        self.shown, self.address = shown, address
        shown.open(address, 1100, 900)
        self.until(f"{CANVAS} && {CANVAS}.dataset.kind === 'png'", "no picture is shown")

    def until(self, script, what):
        """Wait until an expression of JavaScript is true."""
        until(lambda: self.shown.evaluate(script), what)

    def click(self, text):
        """Click on the button that begins with a text."""
        assert self.shown.evaluate(CLICK.format(text)), text

    def box(self, selector):
        """(left, top, right, bottom) of an element in the window."""
        return self.shown.evaluate(BOX.format(selector))

    def mouse(self, kind, x, y, buttons=1):
        """Move, press or release the left button, in pixels of the window."""
        left = "left" if buttons or kind == "mouseReleased" else "none"
        place = {"x": x, "y": y, "button": left, "buttons": buttons, "clickCount": 1}
        self.shown.ask("Input.dispatchMouseEvent", type=kind, **place)

    def drag(self, start, end):
        """Drag from one point to another one."""
        self.mouse("mousePressed", *start)
        self.mouse("mouseMoved", *end)
        self.mouse("mouseReleased", *end, 0)


@pytest.mark.slow
def test_a_page_is_opened_turned_changed_and_closed(tmp_path):
    words = ["-u", "-m", "taichi_tracer", "view", "cube", "--view", "normal", "--browser"]
    environment = os.environ | {"PYTHONPATH": str(Path(tt.__file__).parents[1])}
    program = subprocess.Popen(
        [sys.executable, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),  # may be ignored, as in CI
    )
    try:
        address = next(found[0] for line in program.stdout if (found := re.search(r"http://\S+", line)))
        with browser.started(tmp_path) as shown:
            page = Page(shown, address)
            page.until(
                f"{CANVAS}.width === {CANVAS}.parentElement.parentElement.clientWidth", "it does not fill the page"
            )
            left, top, right, bottom = page.box("canvas")
            assert (right - left) * (bottom - top) > 0.6 * 1100 * 900  # the picture fills the window
            seen = shown.evaluate(PIXELS)
            page.drag((left + 100, top + 100), (left + 180, top + 110))
            until(lambda: shown.evaluate(PIXELS) != seen, "a drag turns nothing")
            page.click("material_id")
            page.until(f"{CANVAS}.dataset.view === 'material_id'", "a button changes nothing")
            page.click("mis")
            page.until("document.querySelector('.tt-strip').innerText.startsWith('compiling mis')", "no word of it")
            page.until(f"{CANVAS}.dataset.view === 'mis'", "no light is shown")
            numbers = "document.querySelector('.tt-numbers').textContent"
            page.until(f"/samples · RMSE .* ± .* typical pixel/.test({numbers})", "no error")
            page.click("Compare two")
            page.until("!document.querySelector('.tt-border').hidden", "no border is shown")
            left, top, right, bottom = page.box("canvas")
            page.drag(((left + right) / 2, top + 50), (left + 100, top + 50))
            assert shown.evaluate(f"{BORDER} * ({right} - {left}) / 100") == pytest.approx(100, abs=3)
            page.click("One picture")
            page.click("Explain a pixel")
            page.drag((left + 200, top + 200), (left + 200, top + 200))
            page.until("/generate_ndc_coords/.test(document.querySelector('.tt-answer').textContent)", "no explanation")
            assert page.box(".tt-drawer")[3] <= 900  # it is in sight, and scrolls by itself
            assert not shown.evaluate("document.querySelector('.tt-mark').hidden")
            page.click("Close")
            page.mouse("mouseMoved", left + 210, top + 205, 0)
            page.until("/sees/.test(document.querySelector('.tt-pointed').textContent)", "no numbers of a pixel")
            asked = [url for url in shown.requests if not url.startswith((address.partition("#")[0], "blob:"))]
            assert asked == [one for one in shown.complaints if not one.startswith("Canvas2D")] == []  # PIXELS reads
            program.send_signal(signal.SIGINT)
            page.until("document.querySelector('.tt-bar').inert", "nobody says that the program has ended")
    finally:
        program.send_signal(signal.SIGINT)
        rest = program.communicate(timeout=60)[0]
    assert program.returncode in (0, 130)
    assert "Traceback" not in rest
