"""A choice that is compiled can be cancelled: what was shown before is shown again, and it can be chosen once more."""

import json

import pytest
from support import long_except, start

import taichi_tracer as tt
from taichi_tracer.apps.cancelling import Cancelled, Cancelling
from taichi_tracer.apps.session import Session
from taichi_tracer.system import compiling


@pytest.fixture
def session():
    start("f32")
    session = Session(tt.A2Renderer(tt.load_scene_data("cube", environment="studio"), 16, 12).use("uniform"))
    shown(session)
    yield session
    session.renderer.scene_data.destroy()


def shown(session):
    """The name of what the next frame shows."""
    session.watch()
    session.ask()
    session.step(0.0)
    return json.loads(session.newest(0).state)["view"]


CHOICES = [
    {"type": "use", "what": "estimator", "name": "brdf"},
    {"type": "environment", "name": "sunny"},
    {"type": "triangle_test", "name": "moller_trumbore"},
]


def state_of(session):
    """What can be chosen."""
    choices = session.choices
    return session.renderer.active.name, choices.environment, choices.triangle_test, session.split


@pytest.mark.parametrize("event", long_except(CHOICES, CHOICES[0]), ids=lambda event: event["type"])
def test_what_was_shown_before_is_shown_again(session, event):
    before = state_of(session)
    session.post(event)
    session.post({"type": "cancel"})
    assert shown(session) == "uniform"
    assert session.message == "Cancelled."
    assert state_of(session) == before
    shown(session)
    session.post(event)
    shown(session)
    assert session.message == ""
    assert state_of(session) != before


def test_nothing_is_cancelled_while_nothing_is_compiled(session):
    session.post({"type": "cancel"})
    assert shown(session) == "uniform"
    assert session.message == ""
    assert not session.is_cancelled


def test_watching_ends_with_the_work(session):
    with Cancelling(session).while_compiling():
        assert len(compiling.watchers) > 0
        session.is_cancelled = True
        with pytest.raises(Cancelled):
            compiling.watchers[-1].begins(compiling.Kernel("one"))
    assert not any(isinstance(one, Cancelling) for one in compiling.watchers)
    assert not session.is_cancelled
