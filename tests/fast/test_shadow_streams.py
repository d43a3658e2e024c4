"""Streams of shadow rays: the answers of single rays, one by one, whatever the rays and the primitives."""

import numpy as np
import pytest
from shadows import Asking, check
from shapes import SQUARE, lattice, random_spheres, soup, sphere, with_spheres
from support import long_except

import taichi_tracer as tt
from taichi_tracer.fast.shadow_streams import ShadowStreams
from taichi_tracer.geometry import Mesh

pytestmark = pytest.mark.usefixtures("f32")


MESHES = {
    "soup": lambda rng: Mesh(*soup(rng, 400)),
    "lattice of whole numbers": lambda rng: Mesh(*lattice(rng, 120)),
    "closed sphere": lambda rng: Mesh(*sphere()),
    "square": lambda rng: Mesh(*SQUARE),
    "few triangles, in lanes": lambda rng: Mesh(*soup(rng, 40, 1.0)),
}


@pytest.mark.parametrize("name", long_except(MESHES, "few triangles, in lanes"))
def test_streams_answer_as_single_rays(name):
    check(MESHES[name](np.random.default_rng(0)), ShadowStreams, make=ShadowStreams)


@pytest.mark.long
def test_with_another_triangle_test_and_with_spheres():
    rng = np.random.default_rng(0)
    check(Mesh(*soup(rng, 400)), ShadowStreams, triangle_test="moller_trumbore")
    check(with_spheres(random_spheres(rng, 60), *soup(rng, 200)), ShadowStreams)
    check(with_spheres(random_spheres(rng, 20), *soup(rng, 30)), ShadowStreams)


@pytest.mark.long
def test_no_ray_and_one_ray():
    scene = tt.SceneData(Mesh(*sphere()))
    alone, together = Asking(scene.ray_intersector, np.array([[0.0, 0, 0]]), np.array([[0.0, 0, 1]])).answers()
    assert alone.tolist() == together.tolist() == [True]
