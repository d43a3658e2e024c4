"""Look-ups of sixteen directions at once: the numbers of ``Environment``, to the last bit."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.environment import Environment
from taichi_tracer.fast.lanes import LANES, lanes
from taichi_tracer.fast.look_ups import LookUps, can_wait_for
from taichi_tracer.ray import no_hit

pytestmark = pytest.mark.usefixtures("f32")


def scene_light(environment, **options):
    """The environment as the light of a scene."""
    scene = tt.load_scene_data("cube", environment=environment, **options)
    return scene, scene.in_kernels().lights.far[0]


@ti.data_oriented
class Looking:
    """The same directions in both forms."""

    def __init__(self, light, directions):
        self.light, self.count = light, len(directions)
        self.groups = self.count // LANES
        self.d = ti.Vector.field(3, float, self.count)
        self.d.from_numpy(directions.astype(np.float32))
        self.look_ups = LookUps(light, 2, self.count, self.groups, finds_pdf=True)
        self.alone, self.together, self.in_groups = (ti.Vector.field(5, float, self.count) for _ in range(3))
        self.pdf_alone, self.pdf_together = (ti.field(float, self.count) for _ in range(2))

    @ti.kernel
    def look(self):
        for _ in range(1):
            self.look_ups.clear(1)
            for i in range(self.count):
                self.look_ups.add(1, self.d[i])
            for g in range(self.groups):
                dx, dy, dz = lanes(0.0), lanes(0.0), lanes(0.0)
                for k in ti.static(range(LANES)):
                    dx[k], dy[k], dz[k] = self.d[g * LANES + k].x, self.d[g * LANES + k].y, self.d[g * LANES + k].z
                self.look_ups.add_group(1, dx, dy, dz)
            self.look_ups.find(1)
            for i in range(self.groups * LANES):
                k = self.look_ups.number_in_group(i // LANES, i % LANES)
                u, v = self.look_ups.coords(1, k)
                light = self.look_ups.look_up(1, k)
                self.in_groups[i] = ti.Vector([u, v, light.x, light.y, light.z])
            for i in range(self.count):
                u, v = self.look_ups.coords(1, i)
                light = self.look_ups.light_of[1, i]
                self.together[i] = ti.Vector([u, v, light.x, light.y, light.z])
                self.pdf_together[i] = self.look_ups.pdf_of[1, i]
        for i in self.alone:
            direction = self.light.with_y_up(self.d[i])
            u, v = self.light.environment.coords(direction)
            light = self.light.environment.radiance(direction)
            self.alone[i] = ti.Vector([u, v, light.x, light.y, light.z])
            self.pdf_alone[i] = self.light.pdf(tm.vec3(0), self.d[i], no_hit())


@pytest.mark.parametrize("up_axis", ["y", "z"])
def test_the_same_coordinates_radiance_and_density(up_axis):
    rng = np.random.default_rng(3)
    environment = Environment(rng.uniform(size=(32, 64, 3)), intensity=1.7, rotation=40)
    scene, light = scene_light(environment, up_axis=up_axis)
    light.prepare()
    d = rng.normal(size=(5003, 3))
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    d = np.concatenate([axes, d / np.linalg.norm(d, axis=1, keepdims=True)])
    looking = Looking(light, d)
    looking.look()
    np.testing.assert_array_equal(looking.together.to_numpy(), looking.alone.to_numpy())
    np.testing.assert_array_equal(looking.pdf_together.to_numpy(), looking.pdf_alone.to_numpy())
    assert np.ptp(looking.pdf_alone.to_numpy()) > 0.05
    of_groups = slice(looking.groups * LANES)
    np.testing.assert_array_equal(looking.in_groups.to_numpy()[of_groups], looking.alone.to_numpy()[of_groups])
    assert np.ptp(looking.alone.to_numpy(), axis=0).min() > 0.5
    scene.destroy()


def test_what_is_looked_up_at_once():
    class Sky(Environment):
        @ti.func
        def query_ray(self, ray):
            return tm.vec3(1)

    image = np.random.default_rng(0).uniform(size=(4, 8, 3))
    for environment, can_wait in (
        (Environment(image), True),
        (Environment(image, lookup="bilinear"), False),
        (Sky(image), False),
        (Environment(np.ones((4, 8, 3))), False),
    ):
        scene, light = scene_light(environment)
        assert can_wait_for(light) == can_wait
        scene.destroy()
