"""Every registered camera keeps its contract in each precision; those that break it in one point are found."""

import pytest
import taichi as ti
import taichi.math as tm
from support import start

import taichi_tracer as tt
from contracts.registered import broken_parts, check_fails, every
from taichi_tracer.contracts import cameras


@every("camera")
def test_camera(precision, part):
    cameras.check_camera(part)


@ti.data_oriented
class OffCentre(tt.Camera):
    """Pixel centres are forgotten: everything is half a pixel off."""

    name = "broken: misses at"

    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y):
        return tm.vec2(2 * pixel_x / self.width - 1, 2 * pixel_y / self.height - 1)


@ti.data_oriented
class NotFinite(tt.Camera):
    """0/0 in the middle of the picture."""

    name = "broken: a ray that is not finite"

    @ti.func
    def generate_ray(self, pixel_x, pixel_y):
        ndc = self.generate_ndc_coords(pixel_x, pixel_y)
        ray = self.ray_through(ndc)
        ray.direction *= ndc.x / ndc.x
        return ray


@ti.data_oriented
class NotUnit(tt.Camera):
    name = "broken: not of unit length"

    @ti.func
    def ray_through(self, ndc):
        m = self.camera_to_world[None]
        origin = tm.vec3(m[0, 3], m[1, 3], m[2, 3])
        return tt.Ray(origin=origin, direction=(m @ self.generate_camera_coords(ndc)).xyz)


@ti.data_oriented
class StaysThere(tt.Camera):
    """The eye of the first moment is baked in."""

    name = "broken: does not move"

    @ti.func
    def generate_ray(self, pixel_x, pixel_y):
        ray = self.ray_through(self.generate_ndc_coords(pixel_x, pixel_y))
        return tt.Ray(origin=tm.vec3(0, 0, 5), direction=ray.direction)


@ti.data_oriented
class WorldAxes(tt.Camera):
    """Right in the first pose alone: the frame is not asked."""

    name = "broken: looks along −z"

    @ti.func
    def ray_through(self, ndc):
        p, m = self.generate_camera_coords(ndc), self.camera_to_world[None]
        direction = tm.normalize(tm.vec3(m[0, 0] * p.x, p.y, -1))
        return tt.Ray(origin=tm.vec3(m[0, 3], m[1, 3], m[2, 3]), direction=direction)


@ti.data_oriented
class OneHanded(tt.Camera):
    name = "broken: handedness does not mirror"

    def compute_matrix(self):
        from taichi_tracer.formulas.camera_frame import camera_frame

        return camera_frame(self.eye, self.at, self.up, "left")


@ti.data_oriented
class WholePixels(tt.Camera):
    name = "broken: only some fractions of a pixel"

    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y):
        x, y = tm.floor(2 * pixel_x + 1.01) / 2, tm.floor(2 * pixel_y + 1.01) / 2  # and halves, so that `at` is met
        return tm.vec2(2 * x / self.width - 1, 2 * y / self.height - 1)


@pytest.mark.long
@broken_parts(
    {
        OffCentre: "the central ray passes",
        NotFinite: "has a ray that is not finite",
        NotUnit: "has not unit length",
        StaysThere: "the central ray",
        WorldAxes: "the central ray",
        OneHanded: "not mirrored by handedness",
        WholePixels: "a third of the way",
    }
)
def test_broken_camera_is_found(broken, reason):
    start("f32")
    check_fails(broken, cameras.check_camera, reason)
