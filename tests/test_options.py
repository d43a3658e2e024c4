"""The options of scenes and renderers: each is named, typed, explained and given its default in one file."""

import re

import pytest
import taichi as ti

import taichi_tracer as tt
from taichi_tracer import options
from taichi_tracer.apps import pictures
from taichi_tracer.settings import RenderSettings

BOTH = [(options.SceneOptions, options.SCENE_DEFAULTS), (options.RendererOptions, options.RENDERER_DEFAULTS)]
SQUARE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]


@pytest.mark.parametrize(("kind", "defaults"), BOTH)
def test_every_option_has_a_type_a_default_and_an_explanation_in_the_same_order(kind, defaults):
    explained = re.findall(r"^    (\w+): ", kind.__doc__, re.MULTILINE)
    assert list(kind.__annotations__) == list(defaults) == explained


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


@pytest.mark.parametrize("is_long", [False, True])
def test_a_replaced_method_runs_in_scenes_of_many_triangles_too(is_long, monkeypatch):
    request = pictures.request_of(RenderSettings("specular_spheres"))
    assert request.load(is_long).ray_intersector.name == "wide_bvh"

    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        return tt.no_hit()

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        return tt.no_hit()

    for owner, method, own in (
        (tt.RayIntersector, "intersect_triangle", intersect_triangle),
        (tt.BVHRayIntersector, "search", search),
    ):
        monkeypatch.setattr(owner, method, own)
        assert method in request.load(is_long).ray_intersector.replaced
        monkeypatch.undo()
