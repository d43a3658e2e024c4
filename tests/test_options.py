"""The options of scenes and renderers: each is named, typed, explained and given its default in one file."""

import inspect
import re
import subprocess
import sys

import pytest

import taichi_tracer as tt
from taichi_tracer import options

BOTH = [(options.SceneOptions, options.SCENE_DEFAULTS), (options.RendererOptions, options.RENDERER_DEFAULTS)]
SQUARE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]


@pytest.mark.parametrize(("kind", "defaults"), BOTH)
def test_every_option_has_a_type_a_default_and_an_explanation_in_the_same_order(kind, defaults):
    explained = re.findall(r"^    (\w+): ", kind.__doc__, re.MULTILINE)
    assert list(kind.__annotations__) == list(defaults) == explained


@pytest.mark.parametrize("function", [tt.load_scene_data, tt.scene_from_mesh, tt.SceneData.__init__])
def test_the_signature_and_the_help_of_what_makes_a_scene_have_every_option(function):
    shown = inspect.signature(function).parameters
    assert set(options.SCENE_DEFAULTS) < set(shown)
    assert {shown[name].kind for name in options.SCENE_DEFAULTS} == {inspect.Parameter.KEYWORD_ONLY}
    assert all(re.search(rf"^ *{name}: ", inspect.getdoc(function), re.MULTILINE) for name in options.SCENE_DEFAULTS)


@pytest.mark.parametrize(
    ("call", "caller"),
    [
        (lambda **wrong: tt.load_scene_data("no such scene", **wrong), "load_scene_data"),
        (lambda **wrong: tt.scene_from_mesh(*SQUARE, **wrong), "scene_from_mesh"),
        (lambda **wrong: tt.SceneData(None, **wrong), "SceneData"),
    ],
)
def test_an_unknown_option_is_told_with_the_nearest_name_before_anything_else(call, caller):
    told = f"^unknown option of {caller} 'enviroment': did you mean 'environment'\\? known are [^\n]*two_sided_lamps"
    with pytest.raises(TypeError, match=told):
        call(enviroment="studio")


def test_arguments_of_the_function_itself_are_suggested_too():
    with pytest.raises(TypeError, match="'colour': did you mean 'color'"):
        tt.scene_from_mesh(*SQUARE, colour=(1, 0, 0))


@pytest.mark.parametrize("name", ["A1Renderer", "A4Renderer", "MapRenderer", "RT3Renderer"])
def test_renderers_tell_an_unknown_option_too_and_show_every_known_one(name):
    renderer_class, scene = getattr(tt, name), tt.scene_from_mesh(*SQUARE, intersector="brute_force")
    with pytest.raises(TypeError, match=f"^unknown option of {name} 'sampller': did you mean 'sampler'"):
        renderer_class(scene, 8, 8, sampller="sobol")
    assert {"width", "height", *options.RENDERER_DEFAULTS} < set(inspect.signature(renderer_class).parameters)


def test_the_given_options_come_before_the_defaults():
    found = options.all_options("it", {"seed": 3}, options.RENDERER_DEFAULTS)
    assert found == {**options.RENDERER_DEFAULTS, "seed": 3}
    assert options.RENDERER_DEFAULTS["seed"] == 0


def test_a_function_may_have_other_defaults():
    assert inspect.signature(tt.load_scene_data).parameters["environment"].default == "file"
    assert inspect.signature(tt.scene_from_mesh).parameters["environment"].default is None


def test_options_need_no_other_package_when_the_program_runs():
    program = "import sys; sys.modules['typing_extensions'] = None; import taichi_tracer.scene_data_loader"
    assert subprocess.run([sys.executable, "-c", program], timeout=120).returncode == 0
