"""Assignment 1, part 3: six views of what each ray hit."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.func
def id_color(i):
    """A colour of its own for each id. This function is given; it counts in integers, so that large ids keep theirs."""
    color = tm.vec3(0)
    for k in ti.static(range(3)):
        product = ti.cast(i + 1, ti.i64) * (314159265, 662607015, 271828182)[k]
        color[k] = ti.cast(product % 100_000_000, float) / 100_000_000
    return color


@ti.data_oriented
class A1Renderer(tt.A1Renderer):
    """Each method is one view: it turns a hit (``tt.HitData``) into a colour, which is black if ``is_hit`` is 0."""

    @ti.func
    def shade_hit(self, hit_data):
        """(1, 1, 1) on the front of a triangle, (0.5, 0, 0) on its back."""
        color = tm.vec3(0)
        ### BEGIN SOLUTION
        if hit_data.is_hit:
            color = tm.vec3(1)
            if hit_data.is_backfacing:
                color = tm.vec3(0.5, 0, 0)
        ### END SOLUTION
        return color

    @ti.func
    def shade_triangle_id(self, hit_data):
        """``id_color`` of the triangle."""
        color = tm.vec3(0)
        ### BEGIN SOLUTION
        if hit_data.is_hit:
            color = id_color(hit_data.triangle_id)
        ### END SOLUTION
        return color

    @ti.func
    def shade_distance(self, hit_data):
        """distance/max_distance in all three channels, limited to [0, 1], with ``self.max_distance``."""
        color = tm.vec3(0)
        ### BEGIN SOLUTION
        if hit_data.is_hit:
            color = tm.vec3(tm.clamp(hit_data.distance / self.max_distance, 0, 1))
        ### END SOLUTION
        return color

    @ti.func
    def shade_barycentric(self, hit_data):
        """(u, v, w) as red, green and blue, with w = 1 − u − v."""
        color = tm.vec3(0)
        ### BEGIN SOLUTION
        if hit_data.is_hit:
            u = hit_data.barycentric_coords.x
            v = hit_data.barycentric_coords.y
            color = tm.vec3(u, v, 1 - u - v)
        ### END SOLUTION
        return color

    @ti.func
    def shade_normal(self, hit_data):
        """(n + 1)/2, so that every component of the normal n lies in [0, 1]."""
        color = tm.vec3(0)
        ### BEGIN SOLUTION
        if hit_data.is_hit:
            color = (hit_data.normal + 1) / 2
        ### END SOLUTION
        return color

    @ti.func
    def shade_material_id(self, hit_data):
        """``id_color`` of the material."""
        color = tm.vec3(0)
        ### BEGIN SOLUTION
        if hit_data.is_hit:
            color = id_color(hit_data.material_id)
        ### END SOLUTION
        return color
