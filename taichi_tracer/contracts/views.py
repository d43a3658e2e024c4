"""What every view and every tone curve must do: colours in [0, 1].

A view has a colour in [0, 1] of every hit, the same each time, and black of a miss.
Of spheres the colour need only be finite: their ``barycentric_coords`` are longitude and latitude, which have no third.
"""

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.contracts.intersectors import all_primitives
from taichi_tracer.contracts.lab import Rows
from taichi_tracer.contracts.statistics import ABOVE_ZERO, check_near, check_range
from taichi_tracer.formulas import vector_math as tm

SIZE = 40
ROUNDING = 1e-6  # of 0 and 1, where barycentric coordinates are added up


def check_view(view):
    """Colours in [0, 1], the same each time; a miss is black."""
    scene = tt.SceneData(all_primitives(np.random.default_rng(20)))
    camera = tt.Camera(SIZE, SIZE, eye=(0.5, 1, 4), at=(0, 0, 0), fov=50)
    renderer = tt.A1Renderer(scene, camera=camera).use(view)
    ids, image, non_finite = renderer.aov("triangle_id"), renderer.render().image(), renderer.non_finite
    assert non_finite == 0, f"{view.name}: {non_finite} pixels are not finite"
    of_triangles, missed = image[(ids >= 0) & ~np.isin(ids, scene.mesh.sphere_ids)], image[ids < 0]
    check_range(f"{view.name}: a colour", of_triangles, -ROUNDING, 1 + ROUNDING)
    assert not missed.any(), f"{view.name}: a miss is not black, but {missed.max(axis=0)}"
    renderer.reset()
    assert np.array_equal(renderer.render().image(), image), f"{view.name}: the second picture differs from the first"


# ── tone curves ──

TONE_STEPS = 4000
TONE_ROUNDING = 1e-12  # by which the last steps of a curve in float64 may go back
KERNEL_TOLERANCE = 4e-6  # of f32


def check_tone(tone):
    """0 stays 0, white becomes 1, nothing decreases, and kernels agree with Python."""
    check_range(f"{tone.name}: white", tone.white, ABOVE_ZERO)
    even, dark = np.linspace(0.0, tone.white, TONE_STEPS), np.geomspace(1e-9 * tone.white, tone.white, TONE_STEPS)
    x = np.unique(np.concatenate([even, dark]))
    y = np.asarray(tone.curve(x.copy()), np.float64)
    check_range(f"{tone.name}: a value", y)
    assert y[0] == 0, f"{tone.name}: 0 becomes {y[0]}"
    check_near(f"{tone.name}: white, {tone.white:g}, becomes {y[-1]:g}", y[-1], 1, 1e-6)
    assert (np.diff(y) >= -TONE_ROUNDING).all(), f"{tone.name}: it decreases at {x[np.diff(y).argmin()]:.3g}"

    @ti.func
    def of_kernels(value):
        return tone.curve(tm.vec3(value, 0.0, tone.white))

    expected = np.column_stack([y, np.zeros_like(y), np.ones_like(y)])
    what = f"{tone.name}: a kernel and Python differ, or the channels are mixed"
    check_near(what, Rows(of_kernels, [1], [3])(x), expected, KERNEL_TOLERANCE)
