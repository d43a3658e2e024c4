"""The table of options: its words make values, its values make the same words again, and its names are checked."""

import re
from inspect import signature

import pytest

from taichi_tracer.apps.cli import make_parser
from taichi_tracer.camera import make_camera
from taichi_tracer.environment import Environment
from taichi_tracer.formulas.camera_frame import USUAL_HANDEDNESS
from taichi_tracer.options import SCENE_DEFAULTS
from taichi_tracer.sampler import DEFAULT_SAMPLER
from taichi_tracer.settings import OPTIONS, RenderSettings, flag_of
from taichi_tracer.system import runtime

WORDS = {"up_axis": "z", "brdfs": "phong,diffuse", "lights": "point", "smooth": "40", "bounces": "0,1-3"}


def words_for(name):
    """Words that differ from the default."""
    option, flag = OPTIONS[name], flag_of(name)
    if not option.metavar:
        return [flag]
    if isinstance(option.metavar, tuple):
        return [flag, *["0.25", "0.5", "0.75", "0.875"][: len(option.metavar)]]
    number = "2" if option.read is not str else "some_name"
    return [flag, WORDS.get(name, number)]


@pytest.mark.parametrize("name", sorted(OPTIONS))
def test_the_value_of_an_option_makes_its_words_again(name):
    words = words_for(name)
    args = make_parser().parse_args(["render", "cube", *words])
    again = RenderSettings.of(args).words()
    assert again == ([words[0], "2x2"] if name == "size" else words)


@pytest.mark.parametrize("words", ["--max-bounces 3", "--mis-plight 1", "--map-of brdf", "--max-distance 3"])
def test_an_option_that_changes_nothing_is_told(words, capsys):
    from taichi_tracer.apps.pictures import request_of
    from taichi_tracer.apps.render_request import note_unused

    args = make_parser().parse_args(["render", "cube", "--view", "normal", *words.split()])
    note_unused(request_of(RenderSettings.of(args)))
    assert f"{words} changes nothing here: it belongs to" in capsys.readouterr().err


# What need not say its default: the scene's own, or nothing; the description of its group says so.
WITHOUT = {"parts", "bounces", "eye", "at", "up", "window", "fov", "spp", "time", "error", "checkpoint"}
DEFAULTS = {
    "triangle_test": SCENE_DEFAULTS["triangle_test"],
    "effects": SCENE_DEFAULTS["effects"],
    "sampler": DEFAULT_SAMPLER,
    "lookup": signature(Environment).parameters["lookup"].default,
    "intensity": f"{signature(Environment).parameters['intensity'].default:g}",
    "rotation": f"{signature(Environment).parameters['rotation'].default:g}",
    "arch": signature(runtime.init).parameters["arch"].default,
    "precision": signature(runtime.init).parameters["precision"].default,
    "handedness": USUAL_HANDEDNESS,
    "camera": signature(make_camera).parameters["projection"].default,
}


@pytest.mark.parametrize("name", sorted(name for name, option in OPTIONS.items() if option.metavar))
def test_a_help_tells_the_default(name):
    told = OPTIONS[name].help
    assert ("default" in told) == (name not in WITHOUT)
    if name in DEFAULTS:
        assert re.search(rf"\(default: {DEFAULTS[name]}\b", told)
