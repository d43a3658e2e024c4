"""Assignment 2, part 4: the mean of many samples, and one sample of the direct light."""

import taichi as ti
import taichi.math as tm
from sampler import BRDF, UniformSampler

import taichi_tracer as tt
from taichi_tracer.ray import offset_origin


@ti.data_oriented
class A2Renderer(tt.A2Renderer):
    """A progressive renderer: every call of ``render`` adds one sample to each pixel, and shows the mean."""

    @ti.func
    def record(self, x, y, value, index):
        """Given: the renderer calls this method for every sample. ``index`` counts the samples since the last reset."""
        self.film.canvas[x, y] = self.running_mean(self.film.canvas[x, y], value, index)

    @ti.func
    def running_mean(self, mean, sample, count):
        """The mean (vec3) of count + 1 samples, from the mean of the first ``count`` samples and the next sample.

        If count is 0, ``mean`` belongs to an older picture, and must have no influence.
        """
        new_mean = tm.vec3(0)
        ### BEGIN SOLUTION
        new_mean = (mean * count + sample) / (count + 1)
        ### END SOLUTION
        return new_mean

    @ti.func
    def shade_ray(self, ray):
        """One sample of the light (vec3) that arrives along an eye ray.

        A ray that hits nothing shows the environment, ``self.scene_data.environment.query_ray(ray)``. Otherwise, with
        one random direction ω_i of the density p, the light is

            f_r(x, ω_o, ω_i) · max(n·ω_i, 0) / p(ω_i) · V · L_e(ω_i)

        V is 1 if a shadow ray from x in the direction ω_i hits nothing, and L_e is then the environment's light from
        ω_i. If ``self.active.name`` is "uniform", take ω_i and p from ``UniformSampler``, and f_r from ``BRDF``.
        Otherwise take ω_i from ``BRDF``, whose ``evaluate_brdf_factor`` is all that stands before V.

        ``self.scene_data.ray_intersector.query_ray(ray)`` is the hit, and
        ``self.scene_data.material_library.materials[hit.material_id]`` its material. A shadow ray must not hit the
        surface that it leaves: ``offset_origin(hit.position, hit.position_error, hit.normal)`` is a safe origin.
        """
        radiance = tm.vec3(0)
        ### BEGIN SOLUTION
        hit = self.scene_data.ray_intersector.query_ray(ray)
        if hit.is_hit:
            material = self.scene_data.material_library.materials[hit.material_id]
            n = hit.normal
            w_o = -ray.direction
            w_i = tm.vec3(0)
            factor = tm.vec3(0)
            if ti.static(self.active.name == "uniform"):
                w_i = UniformSampler.sample_direction()
                f_r = BRDF.evaluate_brdf(material, w_o, w_i, n)
                cosine = ti.max(0.0, tm.dot(n, w_i))
                factor = f_r * cosine / UniformSampler.evaluate_probability()
            else:
                w_i = BRDF.sample_direction(material, w_o, n)
                factor = BRDF.evaluate_brdf_factor(material, w_o, w_i, n)

            origin = offset_origin(hit.position, hit.position_error, n)
            shadow_ray = tt.Ray(origin=origin, direction=w_i)
            blocker = self.scene_data.ray_intersector.query_ray(shadow_ray)
            if not blocker.is_hit:
                radiance = factor * self.scene_data.environment.query_ray(shadow_ray)
        else:
            radiance = self.scene_data.environment.query_ray(ray)
        ### END SOLUTION
        return radiance
