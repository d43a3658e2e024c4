"""``tt.show`` in a real JupyterLab: the picture in the notebook moves, and at rest it has the pixels of the file."""

import time

import browser
import lab
import numpy as np
import pytest

from taichi_tracer.files.images import read_image

pytestmark = pytest.mark.exhaustive
CODE = """import taichi_tracer as tt
renderer = tt.A1Renderer(tt.load_scene_data("cube"), 96, 64).use("normal")
picture = tt.show(renderer)
picture"""
CANVAS = "document.querySelector('.tt-live canvas')"
PIXELS = f"""(() => {{ const c = {CANVAS};
  return Array.from(c.getContext("2d").getImageData(0, 0, c.width, c.height).data).join(); }})()"""
KERNEL = "jupyterapp.shell.currentWidget.sessionContext.session.kernel"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    with browser.started(tmp_path_factory.mktemp("browser")) as shown, lab.started(folder, CODE) as address:
        shown.open(address, 1300, 900)
        lab.run_all(shown)
        until(lambda: shown.evaluate(f"Boolean({CANVAS} && {CANVAS}.dataset.frame)"), "there is no picture")
        shown.folder = folder
        yield shown


def until(condition, what="it did not happen"):
    """Wait until a condition holds."""
    end = time.monotonic() + lab.PATIENCE
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.2)


def at_rest(page):
    """The pixels of the picture, once it is lossless and does not change."""
    seen = [None]

    def is_quiet():
        time.sleep(0.5)
        seen.append((page.evaluate(f"{CANVAS}.dataset.kind"), page.evaluate(f"{CANVAS}.dataset.frame")))
        return seen[-1] == seen[-2] and seen[-1][0] == "png"

    until(is_quiet, "the picture did not come to rest")
    return np.array(page.evaluate(PIXELS).split(","), int).reshape(64, 96, 4)[..., :3]


def run(page, code):
    """Let the kernel run another cell."""
    page.evaluate(f"void {KERNEL}.requestExecute({{code: {code!r}}})")


def drag(page):
    """Drag across the canvas with the left button."""
    page.evaluate(f"{CANVAS}.scrollIntoView({{ block: 'center' }})")
    time.sleep(0.3)
    box = page.evaluate(f"(() => {{ const b = {CANVAS}.getBoundingClientRect(); return [b.left, b.top]; }})()")
    for k, kind in enumerate(["mousePressed", *["mouseMoved"] * 8, "mouseReleased"]):
        more = {"button": "left", "buttons": int(kind != "mouseReleased"), "clickCount": 1}
        page.ask("Input.dispatchMouseEvent", type=kind, x=box[0] + 30 + 4 * k, y=box[1] + 30, **more)


def test_the_picture_moves_and_has_the_pixels_of_the_file(page):
    before = at_rest(page)
    drag(page)
    after = at_rest(page)
    assert (before != after).any()
    run(page, "renderer.save('now.png')")
    path = page.folder / "now.png"
    until(path.exists, "the kernel did not save the picture")
    time.sleep(0.5)
    assert np.array_equal(np.round(255 * read_image(path)), after)


def test_keys_move_the_camera_and_leave_the_notebook_alone(page):
    before = at_rest(page)
    page.evaluate(f"{CANVAS}.focus()")
    for _ in range(2):  # d d would delete the cell
        for kind in ("keyDown", "keyUp"):
            page.ask("Input.dispatchKeyEvent", type=kind, code="KeyD", key="d", windowsVirtualKeyCode=68)
        time.sleep(0.3)
    assert (before != at_rest(page)).any()
    assert page.evaluate("jupyterapp.shell.currentWidget.content.widgets.length") == 1


def test_buttons_and_other_cells_change_what_is_shown(page):
    status = "document.querySelector('.tt-live .tt-status').textContent"
    page.evaluate("[...document.querySelectorAll('.tt-live button')].find(b => b.textContent === 'Hit').click()")
    until(lambda: page.evaluate(status).startswith("hit:"))
    run(page, "renderer.use('distance')")
    until(lambda: page.evaluate(status).startswith("distance:"))


def test_a_kernel_that_has_ended_is_told(page):
    message = "document.querySelector('.tt-live .tt-message').textContent"
    before = at_rest(page)
    page.evaluate(f"void {KERNEL}.restart()")
    until(lambda: "The kernel has ended" in page.evaluate(message))
    assert np.array_equal(before, np.array(page.evaluate(PIXELS).split(","), int).reshape(64, 96, 4)[..., :3])
    lab.run_all(page)
    until(lambda: page.evaluate(f"Boolean({CANVAS} && {CANVAS}.dataset.frame)") and page.evaluate(message) == "")
    assert np.array_equal(at_rest(page)[0, 0], before[0, 0])


def test_a_view_that_is_closed_is_rendered_no_more(page):
    page.evaluate("jupyterapp.commands.execute('notebook:clear-all-cell-outputs')")
    until(lambda: not page.evaluate(f"Boolean({CANVAS})"))
    time.sleep(15)
    run(page, "open('watched', 'w').write(str(picture.session.is_watched))")
    until((page.folder / "watched").exists)
    time.sleep(0.3)
    assert (page.folder / "watched").read_text() == "False"
