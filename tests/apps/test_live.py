"""The page in a real browser: it is dragged, keys are pressed, and its canvas has the picture's own pixels."""

import os
import re
import signal
import subprocess
import sys
import time

import browser
import pytest

pytestmark = pytest.mark.exhaustive
PATIENCE = 60.0  # seconds for what has to be compiled first
CANVAS = "document.querySelector('canvas')"
PIXELS = f"""(() => {{ const c = {CANVAS};
  return Array.from(c.getContext("2d").getImageData(0, 0, c.width, c.height).data).join(); }})()"""
PICTURE = """(async () => {
  const bitmap = await createImageBitmap(await (await fetch("picture.png")).blob());
  const c = new OffscreenCanvas(bitmap.width, bitmap.height), context = c.getContext("2d");
  context.drawImage(bitmap, 0, 0);
  return Array.from(context.getImageData(0, 0, c.width, c.height).data).join(); })()"""


@pytest.fixture(scope="module")
def address():
    """The address that the command prints."""
    words = [sys.executable, "-m", "taichi_tracer", "view", "cube", "--size", "96x64", "--view", "normal", "--browser"]
    program = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=os.environ | {"PYTHONUNBUFFERED": "1"}
    )
    told = ""
    for line in program.stdout:
        told += line
        if found := re.search(r"http://\S+", line):
            break
    else:
        pytest.fail(told)
    yield found[0]
    program.send_signal(signal.SIGINT)
    rest = program.communicate(timeout=30)[0]
    assert program.returncode in (0, 130)
    assert "Traceback" not in rest


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    with browser.started(tmp_path_factory.mktemp("browser")) as found:
        yield found


@pytest.fixture
def page(shown, address):
    """The open page, which has shown a picture; it complains about nothing, and asks nobody else."""
    shown.open(address, 1100, 900)
    until(lambda: shown.evaluate(f"{CANVAS} && {CANVAS}.dataset.frame"))
    yield shown
    asked = [url for url in shown.requests if not url.startswith((address.partition("?")[0], "blob:"))]
    assert asked == []
    complaints = [text for text in shown.complaints if "willReadFrequently" not in text]  # of this test's own reading
    assert complaints == []


def until(condition, what="it did not happen"):
    """Wait until a condition holds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.1)


def at_rest(page):
    """Wait until the picture is lossless and has not changed for a moment; its pixels."""
    seen = [None]

    def is_quiet():
        time.sleep(0.4)
        seen.append((page.evaluate(f"{CANVAS}.dataset.kind"), page.evaluate(f"{CANVAS}.dataset.frame")))
        return seen[-1] == seen[-2] and seen[-1][0] == "png"

    until(is_quiet, "the picture did not come to rest")
    return page.evaluate(PIXELS)


def mouse(page, kind, x, y, **more):
    """Move or press the pointer at a point of the canvas."""
    left, top = (page.evaluate(f"{CANVAS}.getBoundingClientRect().{side}") for side in ("left", "top"))
    page.ask("Input.dispatchMouseEvent", type=kind, x=left + x, y=top + y, **more)


def click(page, text):
    """Press the button with this text."""
    found = page.evaluate(
        f"(() => {{ const b = [...document.querySelectorAll('button')].find(b => b.textContent === {text!r});"
        " if (b) b.click(); return Boolean(b); })()"
    )
    assert found, text


def test_the_canvas_has_the_pixels_of_the_picture(page):
    pixels = at_rest(page)
    told = page.ask("Runtime.evaluate", expression=PICTURE, awaitPromise=True, returnByValue=True)
    assert pixels == told["result"]["value"]


def test_pointer_keys_and_wheel_move_the_camera(page):
    seen = [at_rest(page)]

    def drag():
        mouse(page, "mousePressed", 40, 30, button="left", buttons=1, clickCount=1)
        for k in range(5):
            mouse(page, "mouseMoved", 40 + 4 * k, 30 + k, button="left", buttons=1)
        mouse(page, "mouseReleased", 60, 36, button="left", clickCount=1)

    def press():
        page.ask("Input.dispatchKeyEvent", type="keyDown", code="KeyD", key="d", text="d")
        time.sleep(0.3)
        page.ask("Input.dispatchKeyEvent", type="keyUp", code="KeyD", key="d")

    for act in (drag, press, lambda: mouse(page, "mouseWheel", 40, 30, deltaX=0, deltaY=-300)):
        act()
        now = at_rest(page)
        assert now != seen[-1]
        seen.append(now)
    click(page, "Reset camera")
    assert at_rest(page) == seen[0]


def test_buttons_switch_and_tell_which_is_pressed(page):
    status = "document.querySelector('.tt-status').textContent"
    for label, name in (("Hit", "hit"), ("Normal", "normal")):
        click(page, label)
        until(lambda name=name: page.evaluate(status).startswith(f"{name}:"))
        pressed = page.evaluate("[...document.querySelectorAll('[aria-pressed=true]')].map(b => b.textContent).join()")
        assert pressed == label
    choose = "(() => { const s = document.querySelector('[data-name=triangle_test]'); s.value = %r;"
    choose += " s.dispatchEvent(new Event('change')); })()"
    page.evaluate(choose % "moller_trumbore")
    until(lambda: page.evaluate("document.querySelector('[data-name=triangle_test]').value") == "moller_trumbore")
    at_rest(page)
    page.evaluate(choose % "watertight")
    at_rest(page)


def test_a_pixel_is_explained(page):
    at_rest(page)
    click(page, "Explain a pixel")
    for kind in ("mousePressed", "mouseReleased"):
        mouse(page, kind, 48, 32, button="left", buttons=1, clickCount=1)
    told = "document.querySelector('.tt-told').textContent"
    until(lambda: "generate_ndc_coords" in page.evaluate(told))
    assert page.evaluate("document.querySelectorAll('.tt-told svg').length") in (0, 2)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_reload_and_a_narrow_page_show_the_picture(page, address, scheme):
    page.open(address, 390, 800, scheme)
    until(lambda: page.evaluate(f"{CANVAS} && {CANVAS}.dataset.frame"))
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_page_without_the_token_is_refused(shown, address):
    shown.ask("Network.clearBrowserCookies")
    shown.open(address.partition("?")[0])
    assert "it contains the token" in shown.evaluate("document.body.textContent")
