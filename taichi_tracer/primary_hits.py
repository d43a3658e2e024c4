"""What every pixel's eye ray meets: a kernel of its own, whose result every view and estimator shades from."""

import taichi as ti
import taichi.math as tm

from taichi_tracer.camera import Camera
from taichi_tracer.ray_intersector import no_hit
from taichi_tracer.scene_data import SceneData


@ti.data_oriented
class PrimaryHits:
    """t, triangle id and barycentrics (u, v) of the nearest hit of every pixel; id −1 where there is none."""

    def __init__(self, scene_data: SceneData, camera: Camera) -> None:
        self.scene_data, self.camera = scene_data, camera
        shape = (camera.width, camera.height)
        self.distance = ti.field(float, shape=shape)
        self.triangle_id = ti.field(ti.i32, shape=shape)
        self.barycentric_coords = ti.Vector.field(2, float, shape=shape)

    @ti.kernel
    def trace(self):
        """Send one eye ray through the centre of every pixel."""
        for x, y in self.triangle_id:
            ray = self.camera.generate_ray(x, y)
            t, triangle_id = self.scene_data.ray_intersector.nearest(ray, 0.0, tm.inf)
            self.distance[x, y] = t
            self.triangle_id[x, y] = triangle_id
            if triangle_id >= 0:
                u, v = self.scene_data.ray_intersector.barycentrics(ray, triangle_id)
                self.barycentric_coords[x, y] = tm.vec2(u, v)

    @ti.func
    def hit_data(self, x, y):
        """HitData of a pixel's eye ray."""
        data = no_hit()
        triangle_id = self.triangle_id[x, y]
        if triangle_id >= 0:
            ray = self.camera.generate_ray(x, y)
            uv = self.barycentric_coords[x, y]
            data = self.scene_data.ray_intersector.describe(ray, self.distance[x, y], triangle_id, uv.x, uv.y)
        return data
