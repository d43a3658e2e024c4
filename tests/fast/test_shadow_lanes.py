"""Shadow rays of one leaf, sixteen at once: the answers of single rays, whatever the rays and the primitives."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE, random_spheres, soup, with_spheres

import taichi_tracer as tt
from taichi_tracer.fast.shadow_streams import ShadowStreams, shadow_rays
from taichi_tracer.formulas.triangles import TriangleTest
from taichi_tracer.geometry import Mesh

pytestmark = pytest.mark.usefixtures("f32")


def few(rng):
    """Primitives that fit into one leaf: three spheres and four triangles."""
    return with_spheres(random_spheres(rng, 3), *soup(rng, 4, 2.0))


def test_a_triangle_test_of_ones_own_and_a_tree_take_streams():
    @ti.func
    def never(o, d, v0, v1, v2):
        return False, tm.inf, 0.0, 0.0, 1.0

    rng = np.random.default_rng(0)
    own = tt.SceneData(Mesh(*SQUARE), triangle_test=TriangleTest("never", never))
    tree = tt.SceneData(Mesh(*soup(rng, 40)))
    assert type(shadow_rays(own.ray_intersector, 1, 4)) is ShadowStreams
    assert type(shadow_rays(tree.ray_intersector, 1, 4)) is ShadowStreams
