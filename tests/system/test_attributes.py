"""A misspelt attribute is refused with the right name; those of a subclass, and of methods, are its own."""

import pytest

import taichi_tracer as tt
from taichi_tracer.system.parts import KnownAttributes


class Known(KnownAttributes):
    """Three attributes, and a method that adds one."""

    width = 3
    height: int

    def __init__(self):
        self.depth = 5

    def open(self):
        self.lid = True


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("widht", r"Known has no attribute 'widht': did you mean 'width'\? Attributes of your own belong into"),
        ("depths", "did you mean 'depth'"),
        ("colour", r"Known has no attribute 'colour'\. Attributes of your own"),
    ],
)
def test_what_is_unknown_is_refused_and_nothing_changes(name, told):
    part = Known()
    with pytest.raises(tt.InputError, match=told):
        setattr(part, name, 1)
    assert vars(part) == {"depth": 5}


def test_a_subclass_has_attributes_of_its_own():
    class Mine(Known):
        colour = "red"

        def __init__(self):
            super().__init__()
            self.weight = 7

    part = Mine()
    part.colour, part.weight = "blue", 8
    assert (part.colour, part.weight) == ("blue", 8)


@pytest.mark.parametrize(
    ("kind", "name", "right"),
    [
        (tt.A4Renderer, "max_bounce", "max_bounces"),
        (tt.A4Renderer, "sead", "seed"),
        (tt.A4Renderer, "jiter", "jitter"),
        (tt.A1Renderer, "max_distanc", "max_distance"),
        (tt.A3Renderer, "mis_plihgt", "mis_plight"),
    ],
)
def test_a_renderer_refuses_what_it_does_not_know(kind, name, right):
    renderer = kind(tt.load_scene_data("cube"), 8, 8)
    with pytest.raises(tt.InputError, match=f"did you mean '{right}'"):
        setattr(renderer, name, 3)


def test_a_camera_refuses_what_it_does_not_know():
    with pytest.raises(tt.InputError, match="Camera has no attribute 'eyes': did you mean 'eye'"):
        tt.Camera(8, 8).eyes = (0, 0, 1)
