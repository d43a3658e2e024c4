import taichi as ti
import taichi.math as tm
import numpy as np

from .ray import Ray


@ti.data_oriented
class Camera:
    def __init__(self, width: int = 128, height: int = 128) -> None:
        # Camera pixel width and height are fixed
        self.width = width
        self.height = height
        # Camera parameters that can be modified are stored as fields
        self.eye = ti.Vector.field(n=3, shape=(), dtype=float)
        self.at = ti.Vector.field(n=3, shape=(), dtype=float)
        self.up = ti.Vector.field(n=3, shape=(), dtype=float)
        self.fov = ti.field(shape=(), dtype=float)
        self.x = ti.Vector.field(n=3, shape=(), dtype=float)
        self.y = ti.Vector.field(n=3, shape=(), dtype=float)
        self.z = ti.Vector.field(n=3, shape=(), dtype=float)
        self.camera_to_world = ti.Matrix.field(n=4, m=4, shape=(), dtype=float)
        self.set_camera_parameters(eye=tm.vec3([0, 0, 5]), at=tm.vec3([0, 0, 0]), up=tm.vec3([0, 1, 0]), fov=60.)

    def set_camera_parameters(self, eye=None, at=None, up=None, fov=None) -> None:
        if eye: self.eye[None] = eye
        if at: self.at[None] = at
        if up: self.up[None] = up
        if fov: self.fov[None] = fov
        self.compute_matrix()

    @ti.kernel
    def compute_matrix(self):
        # TODO
        self.z[None] = (self.at[None] - self.eye[None]).normalized()
        self.x[None] = self.up[None].cross(self.z[None]).normalized()
        self.y[None] = self.z[None].cross(self.x[None])
        x = self.x[None]; y = self.y[None]; z = self.z[None]; e = self.eye[None]
        self.camera_to_world[None] = tm.mat4([x.x, y.x, z.x, e.x], [x.y, y.y, z.y, e.y], [x.z, y.z, z.z, e.z], [0, 0, 0, 1])

    @ti.func
    def generate_ray(self, pixel_x: int, pixel_y: int, jitter: bool = False) -> Ray:
        ndc_coords = self.generate_ndc_coords(pixel_x, pixel_y, jitter)
        camera_coords = self.generate_camera_coords(ndc_coords)
        ray = Ray()
        ray.origin = self.eye[None]
        world = self.camera_to_world[None] @ camera_coords
        ray.direction = tm.normalize(world.xyz)
        return ray

    @ti.func
    def generate_ndc_coords(self, pixel_x: int, pixel_y: int, jitter: bool = False) -> tm.vec2:
        off = tm.vec2(0.5, 0.5)
        if jitter:
            off = tm.vec2(ti.random(), ti.random())
        return tm.vec2(2 * (pixel_x + off.x) / self.width - 1, 2 * (pixel_y + off.y) / self.height - 1)

    @ti.func
    def generate_camera_coords(self, ndc_coords: tm.vec2) -> tm.vec4:
        t = tm.tan(tm.radians(self.fov[None]) / 2)
        return tm.vec4(ndc_coords.x * t * (self.width / self.height), ndc_coords.y * t, 1.0, 0.0)
