"""Streams of shadow rays: the answers of single rays, one by one, whatever the rays and the primitives."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE, lattice, random_rays, random_spheres, soup, sphere, with_spheres
from support import long_except, start

import taichi_tracer as tt
from taichi_tracer.fast.shadow_streams import ShadowStreams
from taichi_tracer.geometry import Mesh
from taichi_tracer.ray import Ray


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


@ti.data_oriented
class Asking:
    """The same rays in both forms: one place for all of them."""

    def __init__(self, intersector, origins, directions):
        self.count, self.intersector = len(origins), intersector
        self.o, self.d = (ti.Vector.field(3, float, self.count) for _ in range(2))
        self.o.from_numpy(origins.astype(np.float32))
        self.d.from_numpy(directions.astype(np.float32))
        self.streams = ShadowStreams(intersector, 2, self.count)
        self.alone, self.together = (ti.field(ti.i32, self.count) for _ in range(2))

    @ti.kernel
    def ask(self):
        for _ in range(1):
            self.streams.clear(1)
            for i in range(self.count):
                self.streams.add(1, self.o[i], self.d[i])
            self.streams.trace(1)
            for i in range(self.count):
                self.together[i] = ti.cast(self.streams.is_blocked(1, i), ti.i32)
        for i in self.alone:
            ray = Ray(origin=self.o[i], direction=self.d[i])
            self.alone[i] = ti.cast(self.intersector.is_blocked(ray, 0.0, tm.inf), ti.i32)

    def answers(self):
        """(of single rays, of streams), each a bool for every ray."""
        self.ask()
        return self.alone.to_numpy() != 0, self.together.to_numpy() != 0


def awkward_rays(rng, vertices):
    """Rays along the axes and through vertices and edges, and rays that are none: 0, infinite and NaN directions."""
    corners = vertices[rng.integers(len(vertices), size=300)]
    axes = np.eye(3)[rng.integers(3, size=300)] * rng.choice([-1.0, 1.0], (300, 1))
    to_edges = (corners + np.roll(corners, 1, axis=0)) / 2 - 3 * axes
    origins = np.concatenate([corners - 2 * axes, corners - 2 * axes, to_edges, np.zeros((4, 3))])
    illegal = np.array([[0, 0, 0], [np.inf, 1, 0], [np.nan, 1, 1], [0, 0, -0.0]])
    directions = np.concatenate([axes, np.roll(axes, 1, axis=0), axes, illegal])
    return origins, directions


MESHES = {
    "soup": lambda rng: Mesh(*soup(rng, 400)),
    "lattice of whole numbers": lambda rng: Mesh(*lattice(rng, 120)),
    "closed sphere": lambda rng: Mesh(*sphere()),
    "square": lambda rng: Mesh(*SQUARE),
}


def check(mesh, seed=1, **options):
    """Compare both forms; some rays are blocked, and some are not."""
    rng = np.random.default_rng(seed)
    scene = tt.SceneData(mesh, **options)
    vertices = np.asarray(mesh.vertices, float)
    found = [random_rays(rng, 1500), awkward_rays(rng, vertices)]
    low, high = vertices.min(axis=0) - 0.5, vertices.max(axis=0) + 0.5
    inside = rng.uniform(low, high, (1500, 3)), rng.normal(size=(1500, 3))
    origins, directions = (np.concatenate(arrays) for arrays in zip(*found, inside, strict=True))
    alone, together = Asking(scene.ray_intersector, origins, directions).answers()
    np.testing.assert_array_equal(together, alone)
    assert 20 < alone.sum() < len(alone) - 20
    assert not together[len(found[0][0]) + 900 : len(found[0][0]) + 904].any()  # the illegal rays


@pytest.mark.parametrize("name", long_except(MESHES, "soup"))
def test_streams_answer_as_single_rays(name):
    check(MESHES[name](np.random.default_rng(0)))


@pytest.mark.long
def test_with_another_triangle_test_and_with_spheres():
    rng = np.random.default_rng(0)
    check(Mesh(*soup(rng, 400)), triangle_test="moller_trumbore")
    check(with_spheres(random_spheres(rng, 60), *soup(rng, 200)))


@pytest.mark.long
def test_no_ray_and_one_ray():
    scene = tt.SceneData(Mesh(*sphere()))
    alone, together = Asking(scene.ray_intersector, np.array([[0.0, 0, 0]]), np.array([[0.0, 0, 1]])).answers()
    assert alone.tolist() == together.tolist() == [True]
