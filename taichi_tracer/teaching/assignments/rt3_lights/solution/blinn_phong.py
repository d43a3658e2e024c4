"""RT3, light: the sum of Blinn and Phong, with highlights, shadows and mirrors.

A ``surface`` has a ``normal`` n and a direction ``w_o`` to the viewer, both unit vectors, a ``material``, and the point
``origin``, where rays leave it. With normals of vertices, n is interpolated. ``geometric_normal`` is then that of the
triangle.
"""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class BlinnPhong(tt.BlinnPhong):
    """The light of the surface that a ray meets, and of what it mirrors. ``self.depth`` is the number of mirrors."""

    @ti.func
    def highlight(self, surface, l):
        """Blinn's highlight (a number) of a light in the direction l. The exponent g is ``surface.material.Ns``.

        h = normalize(ω_o + l)        highlight = max(0, n·h)^g
        """
        value = 0.0
        ### BEGIN SOLUTION
        h = tm.normalize(surface.w_o + l)
        cosine = ti.max(0.0, tm.dot(surface.normal, h))
        value = ti.pow(cosine, surface.material.Ns)
        ### END SOLUTION
        return value

    @ti.func
    def shade(self, scene, surface):
        """The light (vec3) that a surface sends to the viewer, without what it mirrors:

            L = I_a k_a + Σ I_i (k_d max(0, n·l) + k_s highlight) V_i

        ``scene.lights.reflected_ambient(surface.material)`` is I_a k_a, of all ambient lights together. The sum is over
        the lights in ``ti.static(scene.lights.drawn)``. ``light.sample(surface.origin, tm.vec2(0.5))`` of each gives l,
        the distance, I and 1. k_d and k_s are Kd and Ks of ``surface.material``.

        V_i is 0 if the light is behind the plane of the triangle (``geometric_normal`` · l ≤ 0), or if something is
        between: ``scene.is_blocked(surface, l, distance)``. Otherwise, V_i is 1.
        """
        L = tm.vec3(0)
        ### BEGIN SOLUTION
        material = surface.material
        n = surface.normal
        L = scene.lights.reflected_ambient(material)
        for light in ti.static(scene.lights.drawn):
            l, distance, I, one = light.sample(surface.origin, tm.vec2(0.5))
            if tm.dot(surface.geometric_normal, l) > 0 and not scene.is_blocked(surface, l, distance):
                diffuse = material.Kd * ti.max(0.0, tm.dot(n, l))
                glossy = material.Ks * self.highlight(surface, l)
                L += I * (diffuse + glossy)
        ### END SOLUTION
        return L

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """The light (vec3) along an eye ray, of which ``hit`` is the hit: ``shade`` of the surface, and k_m times the
        light along the mirrored ray, which may meet a mirror again. At most ``self.depth`` mirrored rays are followed.

            L = shade(x_0) + k_m(x_0) (shade(x_1) + k_m(x_1) (shade(x_2) + …))

        Kernels have no recursion: a loop keeps the product of all k_m so far. The back of a surface
        (``hit.is_backfacing``) is black and mirrors nothing. An eye ray that hits nothing shows
        ``scene.behind(ray, hit, rng)``, and a mirrored ray ``scene.lights.from_far.radiance(ray, hit)``.

        ``scene.surface_at(ray, hit)`` is the surface, and ``surface.material.Km`` its k_m. The mirrored direction is
        2 (n·ω_o) n − ω_o, ``surface.ray_along(direction)`` the ray that leaves the surface, and
        ``scene.met(surface, ray)`` what it hits.
        """
        L = tm.vec3(0)
        ### BEGIN SOLUTION
        k = tm.vec3(1)
        mirrors = 0
        if not hit.is_hit:
            L = scene.behind(ray, hit, rng)
        while hit.is_hit and not hit.is_backfacing:
            surface = scene.surface_at(ray, hit)
            L += k * self.shade(scene, surface)
            k *= surface.material.Km
            n = surface.normal
            direction = 2 * tm.dot(n, surface.w_o) * n - surface.w_o
            if mirrors == self.depth or tm.dot(surface.geometric_normal, direction) <= 0:
                break
            mirrors += 1
            ray = surface.ray_along(direction)
            hit = scene.met(surface, ray)
            if not hit.is_hit:
                L += k * scene.lights.from_far.radiance(ray, hit)
        ### END SOLUTION
        return L
