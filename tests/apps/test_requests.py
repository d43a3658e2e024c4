"""Requests: resolved once, from words to objects that do not change; nothing writes into argparse's namespace."""

import copy
from dataclasses import FrozenInstanceError, fields, is_dataclass

import pytest

import taichi_tracer as tt
from taichi_tracer.apps.accuracy import study_of
from taichi_tracer.apps.cli import make_parser
from taichi_tracer.apps.render_request import render_of
from taichi_tracer.apps.requests import scene_and_pictures_of
from taichi_tracer.apps.words import as_value, values_of
from taichi_tracer.picture.progress import Target

COMMANDS = {
    "render": (render_of, ["cube"]),
    "view": (scene_and_pictures_of, ["cube"]),
    "info": (scene_and_pictures_of, ["rt3/two_views"]),
    "accuracy": (study_of, ["cube"]),
}


def parsed(*words):
    return make_parser().parse_args([as_value(word) for word in words])


def requests_in(found):
    """Every request within one: those of the command line, all of them dataclasses of the programs or of a study."""
    if isinstance(found, tuple):
        for one in found:
            yield from requests_in(one)
    elif is_dataclass(found) and type(found).__module__.startswith(("taichi_tracer.apps", "taichi_tracer.studies")):
        yield found
        for field in fields(found):
            yield from requests_in(getattr(found, field.name))


@pytest.mark.parametrize("command", COMMANDS)
def test_a_request_cannot_be_changed_and_holds_nothing_that_can(command):
    request_of, words = COMMANDS[command]
    requests = list(requests_in(request_of(parsed(command, *words))))
    assert requests
    for request in requests:
        for field in fields(request):
            with pytest.raises(FrozenInstanceError):
                setattr(request, field.name, None)
            assert not isinstance(getattr(request, field.name), (list, dict, set)), field.name


@pytest.mark.parametrize("command", COMMANDS)
def test_the_namespace_is_read_and_not_written(command):
    request_of, words = COMMANDS[command]
    args = parsed(command, *words)
    before = copy.copy(vars(args))
    request_of(args)
    assert vars(args) == before


@pytest.mark.parametrize(
    ("words", "target"),
    [
        ([], Target(spp=1)),
        (["--estimator", "mis"], Target(spp=64, time=3.0)),
        (["--estimator", "path", "--bounces", "0,1+"], Target(spp=64)),
        (["--estimator", "mis", "--error", "2"], Target(error=0.02)),
        (["--estimator", "mis", "--spp", "5", "--time", "1"], Target(spp=5, time=1.0)),
    ],
)
def test_a_picture_of_light_has_samples_enough_to_be_looked_at(words, target):
    _, (picture,) = scene_and_pictures_of(parsed("render", "cube", *words))
    assert picture.target == target


def test_a_scene_can_be_asked_for_again_by_its_words():
    words = ["--intersector", "brute_force", "--triangle-test", "moller_trumbore", "--effects", "all", "--plain"]
    words += ["--environment", "studio", "--intensity", "2.5", "--rotation", "-30", "--lookup", "bilinear"]
    words += ["--brdfs", "phong,diffuse", "--arch", "cpu", "--precision", "f64", "--fast-math"]
    scene, _ = scene_and_pictures_of(parsed("render", "cube", *words))
    again, _ = scene_and_pictures_of(parsed("render", "cube", "--environment", "studio", *scene.words()))
    assert again == scene
    usual, _ = scene_and_pictures_of(parsed("render", "cube"))
    assert usual.words() == []


def test_light_is_added_only_where_there_is_none():
    def environment_of(*words):
        scene, _ = scene_and_pictures_of(parsed("render", "cube", *words))
        return None if scene.environment is None else scene.environment.name

    assert environment_of("--view", "normal") is None
    assert environment_of("--view", "normal,mis") == "studio"
    assert environment_of("--view", "mis", "--environment", "white") == "white"
    assert environment_of("--view", "mis", "--environment", "none") is None
    assert environment_of("--view", "mis", "--lights", "point") is None


def test_a_camera_takes_what_is_given_and_leaves_the_rest():
    def view_of(*words):
        _, (picture,) = scene_and_pictures_of(parsed("render", "cube", "--size", "20x10", *words))
        return picture.view_of({"eye": (0, 0, 5), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 90.0})

    assert view_of() == {"eye": (0, 0, 5), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 90.0}
    assert view_of("--eye", "-1", "2", "3")["eye"] == (-1, 2, 3)
    windowed = view_of("--window", "-1", "1", "-1", "1")
    assert "fov" not in windowed
    assert windowed["screen_window"] == (-1, 1, -1, 1)
    parallel = view_of("--camera", "orthographic")
    assert parallel["screen_window"] == pytest.approx((-10, 10, -5, 5))
    with pytest.raises(tt.InputError, match="did you mean 'orthographic'"):
        view_of("--camera", "ortographic")


def test_values_are_found_before_the_words_are_parsed():
    words = ["render", "--parts", "a.py", "cube", "--parts=b.py", "--help", "--parts"]
    assert values_of("--parts", words) == ["a.py", "b.py"]
