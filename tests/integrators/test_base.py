"""The interface of integrators: what is asked of a subclass, and a view that is a function or a method."""

import copy

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.integrators.base import Integrator, View

VIEW = {"eye": (0, 0, 4), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 60.0}

pytestmark = pytest.mark.usefixtures("f32")


@ti.func
def red_where_left(hit):
    """Red for x < 0."""
    return ti.select(hit.position.x < 0, tm.vec3(1, 0, 0), tm.vec3(0, 1, 0))


@ti.data_oriented
class AsMethod(View):
    """The same as a method."""

    name, label, aliases = "left_or_right", "Left or right", ("sides",)

    @ti.func
    def color(self, hit):
        return red_where_left(hit)


def rendered(view):
    return tt.A1Renderer(tt.scene_from_mesh(*SQUARE, view=VIEW), 16, 16).use(view).render().image()


def test_a_view_is_a_function_or_a_method():
    """A colour of a hit; a miss is black."""
    by_function = View("left_or_right", "Left or right", red_where_left, aliases=("sides",))
    by_method = AsMethod()
    for attribute in ("name", "label", "aliases", "what", "srgb", "needs_light", "samples_lights"):
        assert getattr(by_function, attribute) == getattr(by_method, attribute)
    image = rendered(by_function)
    np.testing.assert_array_equal(image, rendered(by_method))
    assert not image[0].any()
    # The courses' frame shows the world mirrored: −x is on the right (C-5).
    assert image[8, 5].tolist() == [0, 1, 0]
    assert image[8, 10].tolist() == [1, 0, 0]


def test_a_view_overrides_the_names_of_its_class_where_they_are_given():
    assert (AsMethod("other").name, AsMethod("other").label) == ("other", "Left or right")
    assert AsMethod(aliases=()).aliases == ()


def test_an_integrator_must_say_its_radiance():
    @ti.data_oriented
    class Unfinished(Integrator):
        name = "unfinished"

    scene = tt.scene_from_mesh(*SQUARE, environment="white")
    with pytest.raises(Exception, match=r"Unfinished lacks radiance\(self, scene, ray, hit, rng\)"):
        tt.A2Renderer(scene, 8, 8).use(Unfinished()).render()


def test_an_integrator_sees_the_ray_the_hit_the_scene_and_random_numbers():
    @ti.data_oriented
    class Everything(Integrator):
        name = "everything"

        @ti.func
        def radiance(self, scene, ray, hit, rng):
            first, second = rng.next_2d(), rng.next_1d()
            value = tm.vec3(-1, first.x, second)
            if hit.is_hit:
                towards = scene.geometry.unit_normals[hit.triangle_id]
                value.x = -tm.dot(ray.direction, towards) * hit.distance
            return value

    scene = tt.scene_from_mesh(*SQUARE, view=VIEW, environment="white")
    image = tt.A2Renderer(scene, 16, 16).use(Everything()).render(64).image()
    np.testing.assert_allclose(image[8, 8, 0], 4, rtol=1e-5)  # the distance to the plane
    assert image[0, 0, 0] == -1
    assert (np.abs(image[..., 1:] - 0.5) < 0.2).all()  # means of 64 uniform numbers: 5 σ


def test_a_copy_gives_kernels_values_of_its_own():
    """Two pictures are compared: the weights of one do not change the other."""
    renderer = tt.A3Renderer(tt.load_scene_data("cube", environment="studio"), 8, 8).use("mis_one_sample")
    before = np.asarray(renderer.render(4).image()).copy()
    copy.copy(renderer.active).set(mis_plight=0.0)
    renderer.reset()
    np.testing.assert_array_equal(renderer.render(4).image(), before)
