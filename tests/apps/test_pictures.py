"""From settings to a scene and its pictures."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.apps.cli import main, make_parser
from taichi_tracer.apps.pictures import camera_for, request_of
from taichi_tracer.settings import RenderSettings


def parsed(*words):
    return request_of(RenderSettings.of(make_parser().parse_args(words)))


def test_light_is_added_only_where_there_is_none():
    def environment_of(*words):
        environment = parsed("render", "cube", *words).load().environment
        return None if environment is None else environment.name

    assert environment_of("--view", "normal") is None
    assert environment_of("--view", "normal,mis") == "studio"
    assert environment_of("--view", "mis", "--environment", "white") == "white"
    assert environment_of("--view", "mis", "--environment", "none") is None
    assert environment_of("--view", "mis", "--lights", "point") is None


def test_a_camera_takes_what_is_given_and_leaves_the_rest():
    def view_of(*words):
        (picture,) = parsed("render", "cube", "--size", "20x10", *words).pictures
        return camera_for(picture.settings, {"eye": (0, 0, 5), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 90.0})

    assert view_of() == {"eye": (0, 0, 5), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 90.0}
    assert view_of("--eye", "-1", "2", "3")["eye"] == (-1, 2, 3)
    windowed = view_of("--window", "-1", "1", "-1", "1")
    assert "fov" not in windowed
    assert windowed["screen_window"] == (-1, 1, -1, 1)
    parallel = view_of("--camera", "orthographic")
    assert parallel["screen_window"] == pytest.approx((-10, 10, -5, 5))
    with pytest.raises(tt.InputError, match="did you mean 'orthographic'"):
        view_of("--camera", "ortographic")


def test_a_background_is_a_colour_of_the_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert (
        main(["render", "cube", "--view", "flat", "--size", "8x8", "--background", "0", "0.5", "1", "-o", "a.npy"]) == 0
    )
    corner = np.load("a.npy")[0, 0]
    assert corner == pytest.approx([0, 0.5, 1])


def test_a_picture_of_many_samples_of_light_is_long():
    def is_long(**settings):
        (picture,) = request_of(RenderSettings(scene="cube", **settings)).pictures
        return picture.is_long

    assert is_long(view="mis")
    assert is_long(view="mis", size=(256, 256), time=9.0)
    assert not is_long(view="mis", size=(64, 64), error=5.0)
    assert not is_long(view="mis", spp=8)
    assert not is_long(view="normal", spp=4096)
