"""Directions towards an environment that are drawn for sixteen pixels at once: those of single pixels, bit for bit."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.environment import Environment
from taichi_tracer.fast.lanes import LANES, lanes
from taichi_tracer.fast.look_ups import LightLanes

GROUPS = 300


@ti.data_oriented
class Drawing:
    """The same random numbers in both forms."""

    def __init__(self, light, xi):
        self.light, self.light_lanes = light, LightLanes(light, 2)
        self.xi = ti.Vector.field(2, float, GROUPS * LANES)
        self.xi.from_numpy(xi.astype(np.float32))
        self.alone, self.together = (ti.Vector.field(4, float, GROUPS * LANES) for _ in range(2))

    @ti.kernel
    def draw(self):
        for _ in range(1):
            for g in range(GROUPS):
                first, second = lanes(0.0), lanes(0.0)
                for lane in range(LANES):
                    first[lane], second[lane] = self.xi[g * LANES + lane].x, self.xi[g * LANES + lane].y
                self.light_lanes.find(1, first, second)
                for lane in range(LANES):
                    w_i, pdf = self.light_lanes.sample(1, lane)
                    self.together[g * LANES + lane] = tm.vec4(w_i, pdf)
        for i in self.alone:
            w_i, pdf = self.light.sample_direction(self.xi[i])
            self.alone[i] = tm.vec4(w_i, pdf)


@pytest.mark.parametrize("up_axis", ["y", "z"])
def test_the_same_directions_and_densities(f32, rng, up_axis):
    environment = Environment(rng.lognormal(sigma=2, size=(32, 64, 3)), intensity=1.7, rotation=40)
    scene = tt.load_scene_data("cube", environment=environment, up_axis=up_axis)
    light = scene.in_kernels().lights.far[0]
    light.prepare()
    drawing = Drawing(light, rng.uniform(size=(GROUPS * LANES, 2)))
    drawing.draw()
    alone, together = drawing.alone.to_numpy(), drawing.together.to_numpy()
    np.testing.assert_array_equal(alone.view(np.int32), together.view(np.int32))
    np.testing.assert_allclose(np.linalg.norm(alone[:, :3], axis=1), 1, rtol=1e-6)
    assert len(np.unique(together[:, 3])) > 200
    scene.destroy()
