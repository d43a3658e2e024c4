"""The page in a real browser: it is dragged, keys are pressed, and its canvas has the picture's own pixels."""

import os
import re
import signal
import subprocess
import sys
import time

import browser
import numpy as np
import pytest

PATIENCE = 60.0  # seconds for what has to be compiled first
CANVAS = "document.querySelector('canvas')"
PIXELS = f"""(() => {{ const c = {CANVAS};
  return Array.from(c.getContext("2d").getImageData(0, 0, c.width, c.height).data).join(); }})()"""
PICTURE = """(async () => {
  const headers = { "X-Token": sessionStorage.getItem("taichi_tracer token") };
  const bitmap = await createImageBitmap(await (await fetch("picture.png", { headers })).blob());
  const c = new OffscreenCanvas(bitmap.width, bitmap.height), context = c.getContext("2d");
  context.drawImage(bitmap, 0, 0);
  return Array.from(context.getImageData(0, 0, c.width, c.height).data).join(); })()"""


CONTRAST = """(() => {
  const parts = text => (text.match(/[0-9.]+/g) || []).map(Number);
  const linear = v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const light = ([r, g, b]) => 0.2126 * linear(r / 255) + 0.7152 * linear(g / 255) + 0.0722 * linear(b / 255);
  const behind = element => { for (let e = element; e; e = e.parentElement) {
    const c = parts(getComputedStyle(e).backgroundColor);
    if (c.length === 3 || c[3] > 0) return c;
  } return [255, 255, 255]; };
  return [...document.querySelectorAll("*")].filter(e => e.offsetParent && [...e.childNodes].some(
    n => n.nodeType === 3 && n.textContent.trim())).map(e => {
    const [a, b] = [light(parts(getComputedStyle(e).color)), light(behind(e))].sort((x, y) => y - x);
    return [e.textContent.slice(0, 30), (a + 0.05) / (b + 0.05)]; }).filter(([, ratio]) => ratio < 4.5);
})()"""


@pytest.fixture(scope="module")
def address():
    """The address that the command prints."""
    words = [sys.executable, "-m", "taichi_tracer", "view", "cube", "--size", "96x64", "--view", "normal", "--browser"]
    program = subprocess.Popen(
        words,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a shell in the background ignores it
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
    assert program.returncode in (0, 130, -signal.SIGINT)  # the last: while a kernel is compiled
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
    asked = [url for url in shown.requests if not url.startswith((address.partition("#")[0], "blob:"))]
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


@pytest.mark.long
def test_the_canvas_has_the_pixels_of_the_picture(page):
    pixels = at_rest(page)
    told = page.ask("Runtime.evaluate", expression=PICTURE, awaitPromise=True, returnByValue=True)
    assert pixels == told["result"]["value"]


@pytest.mark.long
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


@pytest.mark.long
def test_buttons_switch_and_tell_which_is_pressed(page):
    status = "document.querySelector('.tt-status').textContent"
    for label, name in (("Hit", "hit"), ("Normal", "normal")):
        click(page, label)
        until(lambda name=name: page.evaluate(status).startswith(f"{name}:"))
        pressed = page.evaluate(
            "[...document.querySelectorAll('.tt-views [aria-pressed=true]')].map(b => b.textContent).join()"
        )
        assert pressed == label
    choose = "(() => { const s = document.querySelector('[data-name=triangle_test]'); s.value = %r;"
    choose += " s.dispatchEvent(new Event('change')); })()"
    page.evaluate(choose % "moller_trumbore")
    until(lambda: page.evaluate("document.querySelector('[data-name=triangle_test]').value") == "moller_trumbore")
    at_rest(page)
    page.evaluate(choose % "watertight")
    at_rest(page)


def press(page, key):
    """Press and release a key of a letter, while the picture has the focus."""
    page.evaluate(f"{CANVAS}.focus()")
    page.ask("Input.dispatchKeyEvent", type="keyDown", code=f"Key{key.upper()}", key=key, text=key)
    page.ask("Input.dispatchKeyEvent", type="keyUp", code=f"Key{key.upper()}", key=key)


@pytest.mark.long
def test_the_pointer_tells_the_numbers_and_the_place_of_its_pixel(page):
    at_rest(page)
    width = page.evaluate(f"{CANVAS}.getBoundingClientRect().width")
    mouse(page, "mouseMoved", width / 2, width / 3)
    told = "document.querySelector('.tt-pointed').textContent"
    until(lambda: "away: " in page.evaluate(told))
    assert page.evaluate(told).startswith("Column 48, row 32: ")
    mouse(page, "mouseMoved", -5, -5)
    until(lambda: page.evaluate(told) == "")


@pytest.mark.long
def test_the_picture_is_zoomed_and_its_section_is_shifted(page):
    pixels, place = at_rest(page), f"JSON.stringify({CANVAS}.getBoundingClientRect())"
    fitted = page.evaluate(place)
    for factor in (1, 2, 4, 8, 16):
        press(page, "z")
        assert page.evaluate(f"{CANVAS}.getBoundingClientRect().width") == 96 * factor
    scrolled = "document.querySelector('.tt-section').scrollLeft"
    before = page.evaluate(scrolled)
    assert before > 0  # the middle stays where it is
    mouse(page, "mousePressed", 700, 300, button="left", buttons=1, clickCount=1)
    mouse(page, "mouseMoved", 650, 300, button="left", buttons=1)
    mouse(page, "mouseReleased", 650, 300, button="left", clickCount=1)
    until(lambda: page.evaluate(scrolled) == before + 50)
    assert at_rest(page) == pixels  # the camera has not moved
    press(page, "z")
    assert page.evaluate(place) == fitted


@pytest.mark.long
def test_keys_save_copy_and_hide(page):
    at_rest(page)
    page.evaluate("window.kept = []; HTMLAnchorElement.prototype.click = function () { kept.push(this.download); }")
    press(page, "p")
    until(lambda: page.evaluate("kept.join()") == "picture.png")
    press(page, "c")
    until(lambda: page.evaluate("document.querySelector('.tt-told').textContent").startswith("Close--eye "))
    click(page, "Close")
    until(lambda: page.evaluate("document.querySelector('.tt-told').textContent") == "")
    for key, part in (("h", ".tt-help"), ("m", ".tt-left"), ("m", ".tt-right")):
        assert page.evaluate(f"document.querySelector('{part}').offsetParent !== null")
        press(page, key)
        assert page.evaluate(f"document.querySelector('{part}').offsetParent === null")
        press(page, key)


@pytest.mark.long
def test_the_histogram_counts_what_is_shown(page):
    pixels = np.array(at_rest(page).split(","), int).reshape(-1, 4)[:, :3]
    page.evaluate("document.querySelector('details').open = true")
    told = "document.querySelector('details p')?.textContent ?? ''"
    until(lambda: "Black" in page.evaluate(told))
    black, white = (100 * share.mean() for share in (pixels.sum(1) == 0, pixels.max(1) == 255))
    assert f"Black: {black:.3g} %" in page.evaluate(told)
    assert f"255: {white:.3g} %" in page.evaluate(told)
    page.evaluate("document.querySelector('details').open = false")


@pytest.mark.exhaustive
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everything_can_be_touched_on_a_phone(page, address, scheme):
    """Whatever is pressed is at least 44 points high and wide, and the picture comes first."""
    page.open(address, 390, 800, scheme)
    until(lambda: page.evaluate(f"{CANVAS} && {CANVAS}.dataset.frame"))
    small = page.evaluate(
        "[...document.querySelectorAll('button, select, summary, input, a')].filter(e => e.offsetParent).map(e => "
        "[e.textContent.slice(0, 20) || e.type, e.getBoundingClientRect().width, e.getBoundingClientRect().height])"
        ".filter(([name, w, h]) => (w < 44 || h < 44) && name !== 'Skip to the picture')"
    )
    assert small == []
    assert page.evaluate(f"{CANVAS}.getBoundingClientRect().top") < 100


@pytest.mark.exhaustive
def test_a_pixel_is_explained(page):
    at_rest(page)
    click(page, "Explain a pixel")
    for kind in ("mousePressed", "mouseReleased"):
        mouse(page, kind, 48, 32, button="left", buttons=1, clickCount=1)
    told = "document.querySelector('.tt-told').textContent"
    until(lambda: "generate_ndc_coords" in page.evaluate(told))
    assert page.evaluate("document.querySelectorAll('.tt-told svg').length") in (
        1,
        3,
    )  # the picture so far; of light, also drawings


@pytest.mark.exhaustive
def test_two_pictures_are_compared_by_a_slider(page):
    normal = at_rest(page)
    click(page, "Compare two")
    until(lambda: page.evaluate("!document.querySelector('.tt-divider').hidden"))
    click(page, "Distance")
    until(lambda: "right distance" in page.evaluate("document.querySelector('.tt-status').textContent"))
    slide = "(() => {{ const s = document.querySelector('.tt-divider'); s.value = {}; s.oninput(); }})()"
    at_rest(page)
    page.evaluate(slide.format(1))
    assert page.evaluate(PIXELS) == normal
    page.evaluate(slide.format(0))
    distance = page.evaluate(PIXELS)
    assert distance != normal
    page.evaluate(slide.format(0.5))
    halves = np.array(page.evaluate(PIXELS).split(","), int).reshape(64, 96, 4)
    for pixels, part in ((normal, np.s_[:, :47]), (distance, np.s_[:, 49:])):
        assert np.array_equal(halves[part], np.array(pixels.split(","), int).reshape(64, 96, 4)[part])
    assert (halves[:, 47:49] == 255).all()  # the line between them
    click(page, "Difference")
    until(lambda: "difference of left and right" in page.evaluate("document.querySelector('.tt-scale').textContent"))
    click(page, "left: normal")
    click(page, "Distance")
    until(lambda: not np.array(at_rest(page).split(","), int).reshape(-1, 4)[:, :3].any(), "a difference is left")
    click(page, "Normal")
    until(lambda: "left normal" in page.evaluate("document.querySelector('.tt-status').textContent"))
    click(page, "One picture")
    until(lambda: page.evaluate("document.querySelector('.tt-divider').hidden"))
    assert at_rest(page) == normal


@pytest.mark.exhaustive
def test_pictures_are_saved_and_the_same_again_is_told(page):
    at_rest(page)
    page.evaluate("window.kept = []; HTMLAnchorElement.prototype.click = function () { kept.push(this.download); }")
    click(page, "Save PNG")
    click(page, "Save EXR")
    until(lambda: page.evaluate("kept.sort().join()") == "picture.exr,picture.png")
    click(page, "The same again")
    told = "document.querySelector('.tt-told').textContent"
    until(lambda: "tt.load_scene_data('cube'" in page.evaluate(told))
    assert "taichi-tracer render cube" in page.evaluate(told)
    assert page.evaluate("[...document.querySelectorAll('.tt-told button')].length") == 3


@pytest.mark.exhaustive
def test_keys_alone_reach_everything(page):
    """Tab goes through every control in order; each has a name that a screen reader tells."""
    at_rest(page)
    click(page, "Compare two")
    until(lambda: page.evaluate("!document.querySelector('.tt-divider').hidden"))
    nodes = page.ask("Accessibility.getFullAXTree")["nodes"]
    roles = {"button", "slider", "combobox", "spinbutton", "application"}
    found = [(n["role"]["value"], n.get("name", {}).get("value", "")) for n in nodes if n.get("role")]
    controls = [(role, name) for role, name in found if role in roles]
    assert len(controls) > 20
    assert [role for role, name in controls if not name.strip()] == []
    wanted = page.evaluate(
        "[...document.querySelectorAll('button,select,input,canvas')].filter(e => e.offsetParent !== null).length"
    )
    page.evaluate("document.body.tabIndex = -1; document.body.focus()")
    seen = set()
    for _ in range(wanted):
        for kind in ("rawKeyDown", "keyUp"):
            page.ask("Input.dispatchKeyEvent", type=kind, key="Tab", code="Tab", windowsVirtualKeyCode=9)
        seen.add(page.evaluate("[...document.querySelectorAll('*')].indexOf(document.activeElement)"))
    assert len(seen) == wanted
    click(page, "One picture")
    until(lambda: page.evaluate("document.querySelector('.tt-divider').hidden"))


@pytest.mark.exhaustive
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_can_be_read(page, address, scheme):
    """Every text has a contrast of at least 4.5 to what is behind it (WCAG 2.1, AA)."""
    page.open(address, 1100, 900, scheme)
    until(lambda: page.evaluate(f"{CANVAS} && {CANVAS}.dataset.frame"))
    low = page.evaluate(CONTRAST)
    assert low == []


@pytest.mark.exhaustive
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_reload_and_a_narrow_page_show_the_picture(page, address, scheme):
    page.open(address, 390, 800, scheme)
    until(lambda: page.evaluate(f"{CANVAS} && {CANVAS}.dataset.frame"))
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


@pytest.mark.exhaustive
def test_a_page_without_the_token_is_refused(shown, address):
    shown.evaluate("sessionStorage.clear()")
    shown.open(address.partition("#")[0])
    until(lambda: "it contains the token" in shown.evaluate("document.body.textContent"))
    assert "it contains the token" in shown.evaluate("document.body.textContent")
