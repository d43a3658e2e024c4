"""What every view must do: a colour in [0, 1] of every hit, the same each time, and black of a miss.

Of spheres the colour need only be finite: their ``barycentric_coords`` are longitude and latitude, which have no third.
"""

from functools import lru_cache

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.contracts.cameras import rays
from taichi_tracer.contracts.intersectors import all_primitives
from taichi_tracer.contracts.statistics import check_range
from taichi_tracer.system import runtime

SIZE = 40
ROUNDING = 1e-6  # of 0 and 1, where barycentric coordinates are added up


@lru_cache(maxsize=1)
def stage(_program):
    """(renderer, (h, w) ids of what its pixels see, (h, w) whether that is a triangle) of a scene with everything."""
    scene = tt.SceneData(all_primitives(np.random.default_rng(20)))
    camera = tt.Camera(SIZE, SIZE, eye=(0.5, 1, 4), at=(0, 0, 0), fov=50)
    y, x = np.mgrid[0:SIZE, 0:SIZE][:, ::-1]
    ids = scene.intersect(*rays(camera, np.column_stack([x.ravel(), y.ravel()]))).triangle_id.reshape(SIZE, SIZE)
    return tt.A1Renderer(scene, camera=camera), ids, (ids >= 0) & ~np.isin(ids, scene.mesh.sphere_ids)


def check_view(view):
    """Colours in [0, 1], the same each time; a miss is black."""
    runtime.ensure()
    renderer, ids, on_triangle = stage(ti.lang.impl.get_runtime().prog)
    renderer.use(view).reset()
    image, non_finite = renderer.render().image(), renderer.non_finite
    assert non_finite == 0, f"{view.name}: {non_finite} pixels are not finite"
    seen, missed = image[on_triangle], image[ids < 0]
    check_range(f"{view.name}: a colour", seen, -ROUNDING, 1 + ROUNDING)
    assert not missed.any(), f"{view.name}: a miss is not black, but {missed.max(axis=0)}"
    renderer.reset()
    assert np.array_equal(renderer.render().image(), image), f"{view.name}: the second picture differs from the first"
