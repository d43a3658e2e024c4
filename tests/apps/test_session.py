"""A picture that is watched: events move and change it, frames show it, and nothing that is asked for ends it."""

import io
import time

import numpy as np
import pytest
from PIL import Image
from support import start

import taichi_tracer as tt
from taichi_tracer.apps.page import session as module
from taichi_tracer.apps.page.channel import NO_FRAME, Watcher, checked
from taichi_tracer.apps.page.session import MOST_EVENTS, Session
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


class Page:
    """A page that shows each frame at once."""

    is_ready, last = True, NO_FRAME

    def show(self, frame):
        self.last = frame


@pytest.fixture(scope="module")
def shared(scene):
    session = Session(tt.A1Renderer(scene, *SIZE).use("normal"), now=Ticking())
    session.watchers.append(Page())
    return session


@pytest.fixture
def session(shared):
    """The session, as it was in the beginning."""
    for event in ({"type": "set", "name": "view", "value": "normal"}, {"type": "reset"}, {"type": "blur"}):
        post(shared, event)
    shared.step(0.0)
    chosen(shared)
    return shared


def post(session, event):
    """Let an event of a page wait."""
    session.add(*checked(event))


def moved(**motion):
    """An event that moves the camera."""
    return {"type": "move", **dict.fromkeys(("orbit_x", "orbit_y", "pan_x", "pan_y", "nearer"), 0.0), **motion}


def compared(mode):
    """An event that shows two pictures, or one."""
    return {"type": "compare", "mode": mode, "side": "right", "equal": "samples"}


def settle(session, most=200):
    """Steps until nothing is left to do; the newest frame, which the page has."""
    for _ in range(most):
        if not session.step(0.01) and not session.is_moving:
            break
    return session.frame


def chosen(session):
    """Wait until what was chosen is shown."""
    end = time.monotonic() + 60
    while session.choice is not None and time.monotonic() < end:
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
    post(session, moved(orbit_x=0.1, orbit_y=0.05))
    session.step(0.0)
    frame = session.frame
    after = session.renderer.camera.eye
    assert frame.kind == "jpeg"
    assert not np.allclose(before, after)
    assert np.linalg.norm(after - session.renderer.camera.at) == pytest.approx(
        np.linalg.norm(before - session.renderer.camera.at), rel=1e-6
    )
    post(session, moved(nearer=0.2))
    post(session, moved(pan_x=0.1))
    session.step(0.0)
    assert not np.allclose(session.renderer.camera.at, session.first_camera["at"])
    post(session, {"type": "reset"})
    settle(session)
    assert np.allclose(session.renderer.camera.eye, session.first_camera["eye"])


def test_choices_and_what_cannot_be_chosen(session):
    for event in (
        {"type": "set", "name": "view", "value": "hit"},
        {"type": "set", "name": "triangle_test", "value": "moller_trumbore"},
        {"type": "set", "name": "fov", "value": 40},
    ):
        post(session, event)
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
        ({"type": "explain", "column": 40, "row": 0, "sample": 0}, "the column must be a whole number from 0 to 31"),
    ):
        post(session, event)
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
        post(session, {"type": "set", "name": name, "value": value})
        session.step(0.0)
        assert value in session.message
    assert started == []


def test_cancel_keeps_what_was_shown(session):
    post(session, {"type": "set", "name": "view", "value": "mis"})
    session.step(0.0)
    assert "mis" in session.choice.text
    post(session, {"type": "cancel"})
    session.step(0.0)
    assert session.choice is None
    assert session.renderer.active.name == "normal"


def test_what_compiles_has_the_processors_for_itself(session):
    post(session, {"type": "set", "name": "view", "value": "mis"})
    settle(session)
    chosen(session)
    assert session.step(0.0)
    session.choose("something that takes long", 60.0, lambda: None, Endless())
    settle(session)
    samples = session.renderer.samples
    session.step(0.0)
    assert session.renderer.samples == samples > 0
    session.on_cancel()


def test_two_pictures_get_the_same_number_of_samples(session):
    for event in ({"type": "set", "name": "view", "value": "nodes"}, compared("sides")):
        post(session, event)
        settle(session)
        chosen(session)
    for _ in range(20):
        session.step(0.0)
    left, right = (one.renderer.samples for one in session.sides)
    assert abs(left - right) <= 1 < left
    post(session, compared("off"))
    session.step(0.0)
    assert len(session.sides) == 1


def test_two_views_beside_each_other_follow_the_camera(session):
    settle(session)
    post(session, compared("sides"))
    session.step(0.0)
    chosen(session)
    post(session, moved(orbit_x=0.1))
    assert pixels(settle(session)).shape == (SIZE[1], 2 * SIZE[0], 3)
    post(session, compared("difference"))
    assert not pixels(settle(session)).any()
    post(session, compared("off"))
    session.step(0.0)


def test_a_pixel_that_is_pointed_at_is_told_without_the_file_again(session):
    before = settle(session)
    post(session, {"type": "point", "column": 16, "row": 12})
    frame = settle(session)
    told = frame.state["pointed"]
    assert (told["column"], told["row"]) == (16, 12)
    assert "away: " in told["place"]
    assert frame.number > before.number
    assert frame.news_after(before)[1] == b""
    assert frame.news_after(NO_FRAME)[1] == frame.data == before.data
    post(session, moved(orbit_x=0.1))
    after = settle(session)
    assert after.news_after(frame)[1] == after.data != b""


def test_nothing_is_rendered_while_nobody_watches(session):
    number = settle(session).number
    session.renderer.camera.set_camera_parameters(fov=33)
    (page,) = session.watchers
    page.is_ready, session._last_asked = False, -1e9
    for _ in range(5):
        session.step(0.01)
    assert session.frame.number == number
    page.is_ready = True
    assert settle(session).number > number


def test_ten_thousand_events_are_no_queue(session):
    for k in range(10_000):
        post(session, {"type": "point", "column": k, "row": 0})
    events = session.take_events(0.0)
    assert len(events) == MOST_EVENTS
    assert events[-1] == ("point", {"column": 9999, "row": 0})  # the oldest ones are dropped
    assert session.take_events(0.0) == []


def test_a_page_that_is_behind_gets_the_newest_frame_alone(session):
    settle(session)
    sent = []
    page = Watcher(session, lambda state, data: sent.append(state))
    session.watchers.append(page)
    try:
        for _ in range(5):
            post(session, moved(orbit_x=0.1))
            settle(session)
        assert len(sent) == 1
        for _ in range(2):
            page.post({"type": "ack", "id": sent[-1]["id"]})
            settle(session)
        assert page.last is session.frame
        page.post({"type": "save", "kind": "png"})
        session.step(0.0)
        assert {"file": "picture.png"} in sent
    finally:
        session.watchers.remove(page)
