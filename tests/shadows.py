"""Shadow rays in both forms: one by one, and in a place of ``ShadowStreams`` or ``ShadowLanes``."""

import numpy as np
import taichi as ti
import taichi.math as tm
from shapes import random_rays

import taichi_tracer as tt
from taichi_tracer.fast.shadow_streams import shadow_rays
from taichi_tracer.ray import Ray
from taichi_tracer.system import runtime


@ti.data_oriented
class Asking:
    """The same rays in both forms: one place for all of them."""

    def __init__(self, intersector, origins, directions, form=shadow_rays):
        self.count, self.intersector = len(origins), intersector
        self.o, self.d = (ti.Vector.field(3, float, self.count) for _ in range(2))
        self.o.from_numpy(origins.astype(runtime.dtype()))
        self.d.from_numpy(directions.astype(runtime.dtype()))
        self.streams = form(intersector, 2, self.count)
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


def check(mesh, form, seed=1, make=shadow_rays, **options):
    """Compare both forms; some rays are blocked, and some are not.

    Args:
        form: the class that answers. make: what makes it.
    """
    rng = np.random.default_rng(seed)
    scene = tt.SceneData(mesh, **options)
    vertices = np.asarray(mesh.vertices, float)
    found = [random_rays(rng, 1500), awkward_rays(rng, vertices)]
    low, high = vertices.min(axis=0) - 0.5, vertices.max(axis=0) + 0.5
    inside = rng.uniform(low, high, (1500, 3)), rng.normal(size=(1500, 3))
    origins, directions = (np.concatenate(arrays) for arrays in zip(*found, inside, strict=True))
    asking = Asking(scene.ray_intersector, origins, directions, make)
    assert type(asking.streams) is form
    alone, together = asking.answers()
    np.testing.assert_array_equal(together, alone)
    assert 20 < alone.sum() < len(alone) - 20
    assert not together[len(found[0][0]) + 900 : len(found[0][0]) + 904].any()  # the illegal rays
