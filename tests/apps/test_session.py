"""A picture that is watched: events move and change it, frames show it, and nothing that is asked for ends it."""

import io
import time

import numpy as np
import pytest
from PIL import Image
from support import start

import taichi_tracer as tt
from taichi_tracer.apps.page import session as module
from taichi_tracer.apps.page.channel import NO_FRAME
from taichi_tracer.apps.page.session import Session
from taichi_tracer.files.images import to_bytes
from taichi_tracer.settings import RenderSettings

SIZE = (32, 24)


@pytest.fixture(scope="module")
def scene():
    start("f32")
    return tt.load_scene_data("cube")


class Endless:
    """A process that never ends."""

    def poll(self):
        pass

    kill = wait = poll


class Ticking:
    """A clock that goes on by 2 ms whenever somebody looks at it, so that no test depends on how fast it runs."""

    def __init__(self):
        self.seconds = 100.0

    def __call__(self):
        self.seconds += 0.002
        return self.seconds


@pytest.fixture(scope="module")
def shared(scene):
    return Session(tt.A1Renderer(scene, *SIZE).use("normal"), now=Ticking())


@pytest.fixture
def session(shared):
    """The session, as it was in the beginning."""
    for event in ({"type": "set", "name": "view", "value": "normal"}, {"type": "reset"}, {"type": "blur"}):
        shared.post(event)
    shared.step(0.0)
    chosen(shared)
    watch(shared)
    return shared


def moved(**motion):
    """An event that moves the camera."""
    return {"type": "move", **dict.fromkeys(("orbit_x", "orbit_y", "pan_x", "pan_y", "nearer"), 0.0), **motion}


def compared(mode):
    """An event that shows two pictures, or one."""
    return {"type": "compare", "mode": mode, "side": "right", "equal": "samples"}


def watch(session):
    """Watch, and take the next frame."""
    session.ask()


def settle(session, most=200):
    """Steps until nothing is left to do; the newest frame."""
    for _ in range(most):
        watch(session)
        if not session.step(0.01) and not session.is_moving:
            break
    return session.newest(0)


def chosen(session):
    """Wait until what was chosen is shown."""
    end = time.monotonic() + 60
    while session.choice is not None and time.monotonic() < end:
        watch(session)
        session.step(0.01)


def pixels(frame):
    return np.asarray(Image.open(io.BytesIO(frame.data)))


def test_the_picture_at_rest_is_lossless(session):
    frame = settle(session)
    assert frame.kind == "png"
    assert np.array_equal(pixels(frame), to_bytes(session.renderer.image(), session.renderer.srgb))
    state = frame.state
    assert (state["sides"][0]["view"], state["width"], state["height"]) == ("normal", *SIZE)
    names = [name for offered in state["offered"] for name, _ in offered["names"]]
    assert {"hit", "normal", "mis", "path"} <= set(names)


def test_dragging_orbits_and_sends_jpeg(session):
    settle(session)
    before = session.renderer.camera.eye
    session.post(moved(orbit_x=0.1, orbit_y=0.05))
    watch(session)
    session.step(0.0)
    frame = session.newest(0)
    after = session.renderer.camera.eye
    assert frame.kind == "jpeg"
    assert not np.allclose(before, after)
    assert np.linalg.norm(after - session.renderer.camera.at) == pytest.approx(
        np.linalg.norm(before - session.renderer.camera.at), rel=1e-6
    )
    session.post(moved(nearer=0.2))
    session.post(moved(pan_x=0.1))
    session.step(0.0)
    assert not np.allclose(session.renderer.camera.at, session.first_camera["at"])
    session.post({"type": "reset"})
    settle(session)
    assert np.allclose(session.renderer.camera.eye, session.first_camera["eye"])


def test_choices_and_what_cannot_be_chosen(session):
    for event in (
        {"type": "set", "name": "view", "value": "hit"},
        {"type": "set", "name": "triangle_test", "value": "moller_trumbore"},
        {"type": "set", "name": "fov", "value": 40},
    ):
        session.post(event)
        settle(session)
        chosen(session)
    assert session.renderer.active.name == "hit"
    assert session.state.settings.triangle_test == "moller_trumbore"
    assert session.renderer.camera.fov == 40
    for event, message in (
        ({"type": "set", "name": "view", "value": "nonsense"}, "nonsense"),
        ({"type": "set", "name": "nothing", "value": "hit"}, "nothing"),
        ({"type": "set", "name": "environment", "value": "/etc/passwd"}, "/etc/passwd"),
        ({"type": "set", "name": "triangle_test", "value": "x"}, "x"),
        ({"type": "set", "name": "seed", "value": 3}, "seed"),
        ({"type": "set", "name": "parts", "value": "evil.py"}, "parts"),
        ({"type": "set", "name": "tone", "value": "x"}, "x"),
        ({"type": "set", "name": "exposure", "value": "many"}, "exposure"),
        ({"type": "explain", "column": 40, "row": 0, "sample": 0}, "the column must be from 0 to 31"),
    ):
        session.post(event)
        session.step(0.0)
        chosen(session)
        assert message in session.message, event


def test_a_page_cannot_name_files_for_the_process_that_compiles(scene, monkeypatch):
    started = []
    monkeypatch.setattr(module, "compiling_process", lambda settings, folder: started.append(settings))
    session = Session(tt.A1Renderer(scene, *SIZE).use("normal"), RenderSettings("cube"))
    for name, value in (
        ("environment", "/etc/passwd"),
        ("triangle_test", "x"),
        ("view", "x"),
        ("scene", "/etc/passwd"),
    ):
        session.post({"type": "set", "name": name, "value": value})
        session.step(0.0)
        assert value in session.message
    assert started == []


def test_cancel_keeps_what_was_shown(session):
    session.post({"type": "set", "name": "view", "value": "mis"})
    session.step(0.0)
    assert "mis" in session.choice.text
    session.post({"type": "cancel"})
    session.step(0.0)
    assert session.choice is None
    assert session.renderer.active.name == "normal"


def test_what_compiles_has_the_processors_for_itself(session):
    session.post({"type": "set", "name": "view", "value": "mis"})
    settle(session)
    chosen(session)
    assert session.step(0.0)
    session.choose("something that takes long", 60.0, lambda: None, Endless())
    settle(session)
    samples = session.renderer.samples
    watch(session)
    session.step(0.0)
    assert session.renderer.samples == samples > 0
    session.on_cancel()


def test_two_pictures_get_the_same_number_of_samples(session):
    for event in ({"type": "set", "name": "view", "value": "nodes"}, compared("sides")):
        session.post(event)
        settle(session)
        chosen(session)
    for _ in range(20):
        watch(session)
        session.step(0.0)
    left, right = (one.renderer.samples for one in session.sides)
    assert abs(left - right) <= 1 < left
    session.post(compared("off"))
    session.step(0.0)
    assert len(session.sides) == 1


def test_two_views_beside_each_other_follow_the_camera(session):
    settle(session)
    session.post(compared("sides"))
    session.step(0.0)
    chosen(session)
    session.post(moved(orbit_x=0.1))
    assert pixels(settle(session)).shape == (SIZE[1], 2 * SIZE[0], 3)
    session.post(compared("difference"))
    assert not pixels(settle(session)).any()
    session.post(compared("off"))
    session.step(0.0)


def test_a_pixel_that_is_pointed_at_is_told_without_the_file_again(session):
    before = settle(session)
    session.post({"type": "point", "column": 16, "row": 12})
    frame = settle(session)
    told = frame.state["pointed"]
    assert (told["column"], told["row"]) == (16, 12)
    assert "away: " in told["place"]
    assert frame.number > before.number
    assert frame.news_after(before)[1] == b""
    assert frame.news_after(NO_FRAME)[1] == frame.data == before.data
    session.post(moved(orbit_x=0.1))
    after = settle(session)
    assert after.news_after(frame)[1] == after.data != b""


def test_nothing_is_rendered_while_nobody_watches(session):
    number = settle(session).number
    session.renderer.camera.set_camera_parameters(fov=33)
    session.ask()
    session._last_wait = -1e9
    for _ in range(5):
        session.step(0.01)
    assert session.newest(0).number == number
    assert settle(session).number > number
