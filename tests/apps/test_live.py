"""The page in a real browser: Chromium opens it, drags, presses keys, and sees the picture's own pixels."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time

import pytest

playwright = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser: pip install playwright")
NAMES = "chromium", "chromium-browser", "google-chrome"
CHROMIUM = next((path for name in NAMES if (path := shutil.which(name))), None)
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium was found: apt-get install chromium"),
]
PATIENCE = 60_000  # milliseconds for what has to be compiled first
PIXELS = """() => { const c = document.querySelector("canvas");
  return Array.from(c.getContext("2d").getImageData(0, 0, c.width, c.height).data); }"""
PICTURE = """async () => {
  const bitmap = await createImageBitmap(await (await fetch("picture.png")).blob());
  const c = new OffscreenCanvas(bitmap.width, bitmap.height), context = c.getContext("2d");
  context.drawImage(bitmap, 0, 0);
  return Array.from(context.getImageData(0, 0, c.width, c.height).data); }"""


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
    assert program.wait(20) in (0, 130)
    assert "Traceback" not in program.stdout.read()


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as driver:
        found = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield found
        found.close()


@pytest.fixture
def page(browser, address):
    """The open page, which has shown a picture; what its console says must be nothing."""
    context = browser.new_context(viewport={"width": 1100, "height": 800})
    found = context.new_page()
    told, asked = [], []
    found.on("console", lambda message: told.append(message.text) if message.type == "error" else None)
    found.on("pageerror", lambda error: told.append(str(error)))
    found.on("request", lambda request: asked.append(request.url))
    found.goto(address)
    found.wait_for_selector("canvas[data-frame]", timeout=PATIENCE)
    yield found
    context.close()
    assert told == []
    own = address.partition("?")[0]
    assert [url for url in asked if not url.startswith((own, "data:", "blob:"))] == []


def frame(page):
    return int(page.evaluate("document.querySelector('canvas').dataset.frame"))


def wait_for(page, view):
    """Wait until the page says that it shows a view."""
    for _ in range(PATIENCE // 100):
        if page.locator(".tt-status").inner_text().startswith(f"{view}:"):
            return
        time.sleep(0.1)
    pytest.fail(f"{view} was not shown")


def at_rest(page):
    """Wait until the picture is lossless and has not changed for a moment."""
    number = -1
    for _ in range(100):
        time.sleep(0.4)
        if page.evaluate("document.querySelector('canvas').dataset.kind") == "png" and frame(page) == number:
            return
        number = frame(page)
    pytest.fail("the picture did not come to rest")


def test_the_canvas_has_the_pixels_of_the_picture(page):
    at_rest(page)
    assert page.evaluate(PIXELS) == page.evaluate(PICTURE)


def test_pointer_keys_and_wheel_move_the_camera(page):
    at_rest(page)
    before = page.evaluate(PIXELS)
    box = page.locator("canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    seen = [before]

    def changes(act):
        act()
        at_rest(page)
        now = page.evaluate(PIXELS)
        assert now != seen[-1]
        seen.append(now)

    def drag():
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 20, y + 6, steps=4)
        page.mouse.up()

    def press():
        page.keyboard.down("d")
        time.sleep(0.2)
        page.keyboard.up("d")

    changes(drag)
    changes(press)
    changes(lambda: page.mouse.wheel(0, -300))
    page.get_by_role("button", name="Reset camera").click()
    at_rest(page)
    assert page.evaluate(PIXELS) == before


def test_buttons_switch_and_tell_which_is_pressed(page):
    page.get_by_role("button", name="Hit", exact=True).click()
    wait_for(page, "hit")
    assert page.get_by_role("button", name="Hit", exact=True).get_attribute("aria-pressed") == "true"
    page.get_by_role("button", name="Normal", exact=True).click()
    wait_for(page, "normal")
    page.get_by_label("Triangle test").select_option("moller_trumbore")
    at_rest(page)
    page.get_by_label("Triangle test").select_option("watertight")


def test_a_pixel_is_explained(page):
    page.get_by_role("button", name="Explain a pixel").click()
    page.locator("canvas").click(position={"x": 48, "y": 32})
    page.wait_for_selector(".tt-told details", timeout=PATIENCE)
    assert "generate_ndc_coords" in page.locator(".tt-told").inner_text()


def test_a_reload_and_a_second_page_show_the_picture(page, browser, address):
    page.reload()
    page.wait_for_selector("canvas[data-frame]", timeout=PATIENCE)
    context = browser.new_context(viewport={"width": 390, "height": 800})
    other = context.new_page()
    other.goto(address)
    other.wait_for_selector("canvas[data-frame]", timeout=PATIENCE)
    width = other.evaluate("document.documentElement.scrollWidth")
    assert width <= 390
    context.close()


def test_a_page_without_the_token_is_refused(browser, address):
    context = browser.new_context()
    answer = context.new_page().goto(address.partition("?")[0])
    assert answer.status == 403
    context.close()
