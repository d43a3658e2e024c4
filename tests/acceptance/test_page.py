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


@pytest.mark.slow
def test_a_page_is_opened_turned_changed_and_closed(tmp_path):
    words = ["-u", "-m", "taichi_tracer", "view", "cube", "--size", "96x64", "--view", "normal", "--browser"]
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
        with browser.started(tmp_path) as page:
            page.open(address, 1100, 900)
            until(lambda: page.evaluate(f"{CANVAS} && {CANVAS}.dataset.kind === 'png'"), "no picture is shown")
            seen = [page.evaluate(PIXELS)]
            left, top = (page.evaluate(f"{CANVAS}.getBoundingClientRect().{side}") for side in ("left", "top"))
            for kind, x in (("mousePressed", 40), ("mouseMoved", 70), ("mouseReleased", 70)):
                place = {"x": left + x, "y": top + 30, "button": "left", "buttons": 1, "clickCount": 1}
                page.ask("Input.dispatchMouseEvent", type=kind, **place)
            until(lambda: page.evaluate(PIXELS) not in seen, "a drag turns nothing")
            seen.append(page.evaluate(PIXELS))
            assert page.evaluate(CLICK.format("Material ID"))
            until(lambda: page.evaluate(PIXELS) not in seen, "a button changes nothing")
            assert page.evaluate(CLICK.format("Explain a pixel"))
            for kind in ("mousePressed", "mouseReleased"):
                place = {"x": left + 48, "y": top + 32, "button": "left", "buttons": 1, "clickCount": 1}
                page.ask("Input.dispatchMouseEvent", type=kind, **place)
            told = "document.querySelector('.tt-told').textContent"
            until(lambda: "generate_ndc_coords" in page.evaluate(told), "no pixel is explained")
            asked = [url for url in page.requests if not url.startswith((address.partition("#")[0], "blob:"))]
            assert asked == []
    finally:
        program.send_signal(signal.SIGINT)
        rest = program.communicate(timeout=60)[0]
    assert program.returncode in (0, 130)
    assert "Traceback" not in rest
