"""Shadow rays of one leaf, sixteen at once: the answers of single rays, whatever the rays and the primitives."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shadows import Asking, check
from shapes import SQUARE, random_spheres, soup, with_spheres

import taichi_tracer as tt
from taichi_tracer.fast.shadow_lanes import ShadowLanes
from taichi_tracer.fast.shadow_streams import ShadowStreams, shadow_rays
from taichi_tracer.formulas.triangles import TriangleTest
from taichi_tracer.geometry import Mesh

pytestmark = pytest.mark.usefixtures("f32")


def few(rng):
    """Primitives that fit into one leaf: three spheres and four triangles."""
    return with_spheres(random_spheres(rng, 3), *soup(rng, 4, 2.0))


@pytest.mark.long
def test_lanes_answer_as_single_rays():
    check(few(np.random.default_rng(0)), ShadowLanes)


@pytest.mark.long
@pytest.mark.parametrize("mesh", [Mesh(*SQUARE), Mesh(*soup(np.random.default_rng(0), 6, 2.0))])
@pytest.mark.parametrize("triangle_test", ["watertight", "moller_trumbore"])
def test_lanes_of_triangles_alone(mesh, triangle_test):
    check(mesh, ShadowLanes, triangle_test=triangle_test)


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 16, 17])
def test_any_number_of_rays(count):
    rng = np.random.default_rng(1)
    scene = tt.SceneData(few(rng))
    alone, together = Asking(scene.ray_intersector, rng.normal(size=(count, 3)), rng.normal(size=(count, 3))).answers()
    np.testing.assert_array_equal(together, alone)


def test_a_triangle_test_of_ones_own_and_a_tree_take_streams():
    @ti.func
    def never(o, d, v0, v1, v2):
        return False, tm.inf, 0.0, 0.0, 1.0

    rng = np.random.default_rng(0)
    own = tt.SceneData(Mesh(*SQUARE), triangle_test=TriangleTest("never", never))
    tree = tt.SceneData(Mesh(*soup(rng, 40)))
    assert type(shadow_rays(own.ray_intersector, 1, 4)) is ShadowStreams
    assert type(shadow_rays(tree.ray_intersector, 1, 4)) is ShadowStreams
