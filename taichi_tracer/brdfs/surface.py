"""A point of a surface, with the BRDF of its material. Integrators work with it."""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.ray import Ray, offset_origin
from taichi_tracer.system.compile_time import compile_time


class Surface:
    """The point where a ray hit something, inside a kernel; ``scene.surface_at(ray, hit)`` makes one.

    Its methods call the BRDF of the material. If the scene has several BRDFs, the kernel chooses among them. If the
    scene has only one, no choice is compiled.

    Attributes:
        origin: the start of rays that leave the surface. It lies off the surface, as close as rounding allows.
        hit: the HitData of the point.
        normal, geometric_normal: the interpolated normal and the plane's normal: unit vectors on the viewer's side.
        w_o: the unit direction to the viewer.
        material: the numbers of the material, as a struct.
        may_transmit: whether any BRDF of the scene lets light through.
    """

    _data_oriented = True  # allows kernels to keep it in a variable and to pass it to functions

    def __init__(self, brdfs: dict, brdf_id, material, origin, hit, w_o) -> None:
        self.numbers, self.brdfs = tuple(brdfs), tuple(brdfs.values())
        self.brdf_id, self.material = brdf_id, material
        self.origin, self.hit, self.w_o = origin, hit, w_o
        self.normal, self.geometric_normal = hit.normal, hit.geometric_normal
        self.may_transmit = any(brdf.transmits for brdf in self.brdfs)

    @compile_time
    def transmits(self):
        """Whether the surface lets light through."""
        return self.has_one_of([brdf.transmits for brdf in self.brdfs])

    @compile_time
    def is_delta(self):
        """Whether the surface reflects into a single direction."""
        return self.has_one_of([brdf.is_delta for brdf in self.brdfs])

    @ti.func
    def has_one_of(self, brdfs: ti.template()):
        """Whether the material has one of those BRDFs of the scene of which a list says "true"."""
        found = False
        for i in ti.static(range(len(self.brdfs))):
            if ti.static(brdfs[i]):
                found = found or self.has(i)
        return found

    @ti.func
    def ray_along(self, w_i):
        """The ray that leaves the surface in the direction w_i; it starts on the side to which it goes."""
        origin = self.origin
        if ti.static(self.may_transmit):
            if tm.dot(self.geometric_normal, w_i) < 0:
                origin = offset_origin(self.hit.position, self.hit.position_error, -self.geometric_normal)
        return Ray(origin=origin, direction=w_i)

    @ti.func
    def lets_pass(self, w_i):
        """Whether light can come from w_i: from above the plane of the triangle, or through the surface."""
        return tm.dot(self.geometric_normal, w_i) > 0 or self.transmits()

    @ti.func
    def has(self, i: ti.template()):
        """Whether the material has the i-th BRDF of the scene."""
        return ti.static(len(self.brdfs) == 1) or self.brdf_id == self.numbers[i]

    @ti.func
    def eval(self, w_i):
        """f_r."""
        value = tm.vec3(0)
        for i in ti.static(range(len(self.brdfs))):
            if self.has(i):
                value = self.brdfs[i].eval(self.material, self.w_o, w_i, self.normal)
        return value

    @ti.func
    def eval_cosine(self, w_i):
        """f_r max(n·ω_i, 0)."""
        return self.eval(w_i) * ti.max(0.0, tm.dot(self.normal, w_i))

    @ti.func
    def pdf(self, w_i):
        """The density of ``sample`` at w_i, per solid angle."""
        value = 0.0
        for i in ti.static(range(len(self.brdfs))):
            if self.has(i):
                value = self.brdfs[i].pdf(self.material, self.w_o, w_i, self.normal)
        return value

    @ti.func
    def sample(self, xi):
        """w_i, drawn from the density of the BRDF."""
        w_i = tm.vec3(0)
        for i in ti.static(range(len(self.brdfs))):
            if self.has(i):
                w_i = self.brdfs[i].sample(self.material, self.w_o, self.normal, xi)
        return w_i

    @ti.func
    def weight(self, w_i):
        """f_r max(n·ω_i, 0) / pdf of a direction that ``sample`` returned."""
        value = tm.vec3(0)
        for i in ti.static(range(len(self.brdfs))):
            if self.has(i):
                value = self.brdfs[i].sample_weight(self.material, self.w_o, w_i, self.normal)
        return value
