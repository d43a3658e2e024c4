"""What every view must do: a colour in [0, 1] of every hit, the same in each precision, and black of a miss.

Of spheres the colour need only be finite: their ``barycentric_coords`` are longitude and latitude, which have no third.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.contracts.cameras import rays
from taichi_tracer.contracts.intersectors import all_primitives
from taichi_tracer.system import runtime

SIZE = 40
PRECISIONS = ("f32", "f64")
# Beyond it a view shows rounding. f32 moves a hit by some 1e-6 of its distance, and views may be steep.
TOLERANCE = 2e-3
ROUNDING = 1e-6  # of 0 and 1, where barycentric coordinates are added up
FEW = 0.02  # of the pixels, which lie on an edge: there the two precisions may see different things


@dataclass
class Shot:
    """A view's picture in one precision.

    Attributes:
        image: (h, w, 3). triangle_id: (h, w) what each pixel sees. on_triangle: (h, w) whether it is a triangle.
        is_repeated: whether a second picture has the same bits.
        non_finite: of how many pixels the colour was not finite; the film leaves them black.
    """

    image: np.ndarray
    triangle_id: np.ndarray
    on_triangle: np.ndarray
    is_repeated: bool
    non_finite: int


def shots_of(views):
    """{precision: {name of the view: its ``Shot``}} of a scene with everything: see ``intersectors.all_primitives``."""
    found, former = {}, runtime.ensure()
    for precision in PRECISIONS if former.arch in runtime.F64_ARCHS else PRECISIONS[:1]:
        start_in(precision)
        scene = tt.SceneData(all_primitives(np.random.default_rng(20)))
        camera = tt.Camera(SIZE, SIZE, eye=(0.5, 1, 4), at=(0, 0, 0), fov=50)
        renderer = tt.A1Renderer(scene, camera=camera)
        y, x = np.mgrid[0:SIZE, 0:SIZE][:, ::-1]
        hits = scene.intersect(*rays(camera, np.column_stack([x.ravel(), y.ravel()])))
        ids = hits.triangle_id.reshape(SIZE, SIZE)
        on_triangle = (ids >= 0) & ~np.isin(ids, scene.mesh.sphere_ids)
        found[precision] = {}
        for view in views:
            renderer.use(view).reset()
            image, non_finite = renderer.render().image(), renderer.non_finite
            renderer.reset()
            again = renderer.render().image()
            same = np.array_equal(image, again, equal_nan=True)
            found[precision][view.name] = Shot(image, ids, on_triangle, same, non_finite)
    start_in(former.precision)
    return found


def start_in(precision):
    """Start Taichi in a precision, unless it runs in it."""
    now = runtime.ensure()
    if now.precision != precision:
        runtime.init(now.arch, precision, now.fast_math, force=True, debug=ti.cfg.debug)


# ── the checks ──


def check_view(view, shots=None):
    """Colours in [0, 1], the same each time and in each precision that there is; a miss is black.

    Args:
        shots: of all views, as ``shots_of`` returns them; None renders this view alone.
    """
    shots = shots_of([view]) if shots is None else shots
    pictures = {precision: of[view.name] for precision, of in shots.items()}
    for precision, shot in pictures.items():
        what = f"{view.name} in {precision}"
        assert shot.non_finite == 0, f"{what}: {shot.non_finite} pixels are not finite"
        seen = shot.image[shot.on_triangle]
        assert seen.min() >= -ROUNDING, f"{what}: {seen.min()} is below 0"
        assert seen.max() <= 1 + ROUNDING, f"{what}: {seen.max()} is above 1"
        assert shot.is_repeated, f"{what}: the second picture differs from the first"
        misses = shot.triangle_id < 0
        assert 0.1 < misses.mean() < 0.9
        assert not shot.image[misses].any(), f"{what}: a miss is not black, but {shot.image[misses].max(axis=0)}"
    one, other = pictures[PRECISIONS[0]], pictures.get(PRECISIONS[1], pictures[PRECISIONS[0]])
    same = one.triangle_id == other.triangle_id
    assert same.mean() > 1 - FEW, f"{same.mean():.1%} of the pixels see the same in both precisions"
    off = np.abs(one.image - other.image).max(axis=-1)
    wrong = same & (off > TOLERANCE)
    assert wrong.mean() < FEW, f"{view.name}: {wrong.mean():.0%} of the pixels differ between f32 and f64"
