"""The window: its parts without one, and the whole under a virtual display, with real keys and a real mouse."""

import shlex
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from fake_panel import FakePanel
from PIL import Image

import taichi_tracer as tt
from taichi_tracer.apps import viewer
from taichi_tracer.apps.cli import make_parser
from taichi_tracer.apps.pictures import request_of
from taichi_tracer.files.images import to_bytes
from taichi_tracer.renderer import A1Renderer
from taichi_tracer.settings import RenderSettings

QUICK = {"intersector": "brute_force", "triangle_test": "moller_trumbore"}  # what compiles soonest


@pytest.fixture(scope="module")
def scene():
    return tt.load_scene_data("cornell_box", **QUICK)


@pytest.fixture(scope="module")
def renderer(scene):
    return A1Renderer(scene, width=400, height=390)


@pytest.fixture(scope="module")
def small_renderer(scene):
    return A1Renderer(scene, width=100, height=50)


# ── without a window ──


def pressed(view, label=None, **slides):
    """The panels in which something is pressed or moved; then the window goes on to its next frame."""
    panel = FakePanel(label, **slides)
    view.draw_panel(panel)
    take_choice(view)
    return panel


def take_choice(view):
    """What was chosen is shown, as if its time had come."""
    if view.session.choice is not None:
        view.session.choice.take()
        view.session.choice = None


VIEWS = ["Hit", "Triangle ID", "Distance", "Barycentric", "Normal", "Material ID"]
ESTIMATORS = ["Uniform sphere", "Uniform hemisphere", "BRDF", "Microfacets", "Lights", "MIS, power", "MIS, balance"]
ESTIMATORS += ["MIS, one sample"]
PATHS = ["Paths, implicit", "Paths, explicit", "Paths, MIS"]


def test_the_panel_has_the_courses_texts_and_a_button_per_view_and_estimator(renderer, tmp_path):
    view = viewer.Viewer(renderer.use("normal"), tmp_path)
    panel = pressed(view)
    assert panel.windows == ["Control Panel"]
    assert panel.texts[:2] == ["'Eye' param uses 'wasdqe' keys", "'At' param uses arrow keys"]
    shown = [*VIEWS, *ESTIMATORS, *PATHS]
    shown[VIEWS.index("Normal")] = "Normal [Active]"
    assert panel.buttons == [*shown, "Environment: none", "Save picture (p)", "Reset camera (r)"]
    assert any(text.startswith("Frame: ") for text in panel.texts)


def test_a_button_makes_its_view_the_active_one_after_it_said_so(renderer, tmp_path):
    view = viewer.Viewer(renderer.use("normal"), tmp_path)
    view.draw_panel(FakePanel(pressed="Material ID"))
    panel = FakePanel()
    view.draw_panel(panel)
    assert "One moment: compiling material_id" in "".join(panel.texts)
    take_choice(view)
    assert renderer.active.name == "material_id"
    assert [label for label in pressed(view).buttons if "[Active]" in label] == ["Material ID [Active]"]


def test_the_speed_and_the_reset_of_the_camera(small_renderer, tmp_path):
    view = viewer.Viewer(small_renderer.use("distance"), tmp_path)
    camera = small_renderer.camera
    pressed(view, speed=2.0)
    assert view.session.speed == 3
    camera.set_camera_parameters(fov=25.0)
    view.reset()
    assert (camera.fov, view.session.speed) == (60, 1.5)


def test_saving_tells_where_and_how_to_make_it_again(renderer, tmp_path, capsys):
    view = viewer.Viewer(renderer.use("distance"), tmp_path / "renders")
    renderer.render()
    pressed(view, "Save picture (p)")
    path = tmp_path / "renders" / "cornell_box_distance.png"
    assert (np.asarray(Image.open(path)) == to_bytes(renderer.image())).all()
    assert view.session.message == f"Saved {path}"
    assert "taichi-tracer render" in capsys.readouterr().out


def test_without_a_window_every_view_is_written(small_renderer, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(viewer, "missing_for_window", lambda: ("no screen", "plug one in"))
    assert viewer.show(small_renderer, tmp_path / "renders") == 0
    out = capsys.readouterr().out
    assert "no screen" in out
    assert "plug one in" in out
    assert str(tmp_path / "renders") in out
    for name in A1Renderer.names():
        path = tmp_path / "renders" / f"cornell_box_{name}.png"
        assert str(path) in out
        expected = to_bytes(small_renderer.use(name).render().image())
        assert (np.asarray(Image.open(path)) == expected).all()


@pytest.mark.parametrize("ends", [(0.9, 0.5), (0.01, 0.5)], ids=["in the picture", "in the panel"])
def test_a_drag_and_a_key_within_one_slow_frame_count(small_renderer, tmp_path, ends):
    """Pressed and released between two frames; from the last frame's place on, as far as both are in the picture."""
    view = viewer.Viewer(small_renderer, tmp_path)
    events = [SimpleNamespace(key=key) for key in (viewer.ti.ui.LMB, "d")]
    view.window = SimpleNamespace(
        get_events=lambda _kind: events, get_cursor_pos=lambda: ends, is_pressed=lambda _key: False
    )
    view.cursor, view.drags_picture = (0.6, 0.4), False
    first = np.array(view.renderer.camera.eye)
    is_in_picture = ends[0] > 0.5
    view.draw()
    try:
        view.read_input()
        view.session.move(0.1)
        moved = np.array(view.renderer.camera.eye) - first
        assert (moved[2] != 0) == is_in_picture  # an orbit leaves the plane of the key d, which moves along x
        assert moved[0] != 0
        view.window.get_events = lambda _kind: []
        view.read_input()
        before = view.renderer.camera.eye
        view.session.move(0.1)
        np.testing.assert_array_equal(view.renderer.camera.eye, before)
    finally:
        view.reset()


# ── the real window ──


def test_the_command_of_a_saved_picture_makes_that_picture(renderer, scene):
    renderer.camera.set_camera_parameters(eye=(-0.1234567891, 1, 2.5), at=(1e-7, 1, 0), fov=47.3, handedness="right")
    words = shlex.split(viewer.as_command(renderer))
    assert words[:3] == ["taichi-tracer", "render", "cornell_box"]
    args = make_parser().parse_args(words[1:])
    (picture,) = request_of(RenderSettings.of(args)).pictures
    again = picture.make_renderer(scene)
    for name in ("eye", "at", "up", "fov"):
        np.testing.assert_allclose(getattr(again.camera, name), getattr(renderer.camera, name), rtol=1e-8)
    assert again.camera.handedness == "right"
    assert (again.width, again.height) == (renderer.width, renderer.height)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="X11 is asked on Linux only")
@pytest.mark.parametrize(
    ("name", "reason", "remedy"),
    [("", "DISPLAY is not set", "xvfb-run"), ("localhost:4711.0", "not on this machine", "--browser")],
)
def test_without_a_display_it_is_said_what_is_missing(monkeypatch, name, reason, remedy):
    monkeypatch.setenv("DISPLAY", name)
    found, mends = viewer.missing_for_window()
    assert reason in found
    assert remedy in mends
