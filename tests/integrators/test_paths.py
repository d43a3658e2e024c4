"""Paths against closed forms and against each other: every way to find light, every length, every roulette."""

import numpy as np
import pytest
from shapes import sphere
from support import start

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh

WAYS = ("implicit", "explicit", "path")
EMISSION, ALBEDO = np.array([0.5, 1.0, 2.0]), np.array([0.25, 0.5, 0.75])
MANY = 64

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def room():
    """The inside of a closed ball: every surface emits and reflects the same, so that the radiance is a sum."""
    start("f32")
    vertices, faces = sphere(12, 7)
    material = tt.Material(Kd=tuple(ALBEDO), Ke=tuple(EMISSION))
    view = {"eye": (0.1, 0.2, 0.3), "at": (0, 0, -1), "fov": 60.0}
    scene = tt.SceneData(Mesh(vertices, faces[:, ::-1], materials=[material]), view=view)  # fronts inside
    return tt.A4Renderer(scene, 16, 16)


def rendered(renderer, way, spp, **settings):
    """(3,) mean of the picture, and its standard error from the spread of its pixels."""
    defaults = {"max_bounces": 5, "rr_start_bounce": 0, "rr_termination_probability": 0.0, "roulette": "course"}
    for name, value in {**defaults, "bounces": None, **settings}.items():
        setattr(renderer, name, value)
    image = renderer.use(way).render(spp).image().astype(float).reshape(-1, 3)
    assert renderer.non_finite == 0
    return image.mean(axis=0), image.std(axis=0) / np.sqrt(len(image))


@pytest.fixture(scope="module")
def box():
    """The Cornell box, lit by its lamp."""
    start("f32")
    return tt.load_scene_data("cornell_box")


def test_pictures_by_bounce_refuse_what_cannot_be_added_up(box):
    renderer = tt.A4Renderer(box, 8, 8)
    for bounces, told in (
        ([0, (0, 1)], "both count 0"),
        ([6], "at most 5 bounces"),
        (["1"], "must be"),
    ):
        with pytest.raises(tt.InputError, match=told):
            renderer.pictures_by_bounce(1, bounces)
    with pytest.raises(tt.InputError, match="give adaptive=False"):
        tt.A4Renderer(box, 8, 8, adaptive=True).pictures_by_bounce(1)
    assert renderer.samples == 0


def test_settings_start_the_picture_over_without_compiling(box):
    renderer = tt.A4Renderer(box, 8, 8).render(2)
    assert renderer.is_current()
    for name, value in (
        ("max_bounces", 2),
        ("rr_start_bounce", 1),
        ("rr_termination_probability", 0.5),
        ("roulette", "throughput"),
        ("bounces", (1, 2)),
    ):
        setattr(renderer, name, value)
        assert getattr(renderer, name) == value
        assert not renderer.is_current(), name
        renderer.render(1)
        assert renderer.samples == 1
        setattr(renderer, name, value)  # the same again is no change
        assert renderer.is_current()


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("max_bounces", 65, "max_bounces must be a whole number from 0 to 64, not 65"),
        ("max_bounces", 2.5, "max_bounces must be a whole number"),
        ("rr_start_bounce", -1, "rr_start_bounce must be a whole number from 0 to 64"),
        ("rr_termination_probability", 1.0, "must be at least 0 and less than 1, not 1.0"),
        ("rr_termination_probability", float("nan"), "must be at least 0 and less than 1"),
        ("roulette", "russian", "unknown roulette 'russian': use one of course, throughput"),
        ("bounces", (3, 1), "bounces must be"),
        ("bounces", 3, "bounces must be"),
    ],
)
def test_wrong_settings_are_refused_and_change_nothing(box, name, value, message):
    renderer = tt.A4Renderer(box, 8, 8)
    before = renderer.path_settings.facts()
    with pytest.raises(tt.InputError, match=message):
        setattr(renderer, name, value)
    assert renderer.path_settings.facts() == before
