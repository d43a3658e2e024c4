"""Assignment 3, part 2: light from triangles that emit, by two strategies and by their combination."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.ray import offset_origin


@ti.data_oriented
class A3Renderer(tt.A3Renderer):
    """Direct light from emissive triangles. ``tt.BRDF`` has the right functions of assignment 2."""

    @ti.func
    def to_solid_angle(self, pdf_area, distance, cos_light):
        """A density per area of a light as a density per solid angle, seen from a point at some distance.

            p_ω = p_area · distance² / cos θ_y

        θ_y is the angle between the normal of the light and the direction from it to the point.
        """
        pdf_solid_angle = 1.0
        ### BEGIN SOLUTION
        pdf_solid_angle = pdf_area * distance**2 / cos_light
        ### END SOLUTION
        return pdf_solid_angle

    @ti.func
    def power_heuristic(self, pdf, other_pdf):
        """The weight of a sample of one strategy, if another one could have found it too: p² / (p² + q²)."""
        weight = 1.0
        ### BEGIN SOLUTION
        weight = pdf**2 / (pdf**2 + other_pdf**2)
        ### END SOLUTION
        return weight

    @ti.func
    def shade_ray(self, ray):
        """One sample of the light (vec3) along an eye ray: what the surface emits, and what it reflects of the lights.

        If ``self.active.name`` is "environment", sample the lights alone: ω_i and a triangle from
        ``self.scene_data.lamps.choice.sample_mesh_lights(x)``. The light counts if a ray from x in this direction hits
        this triangle on its front. Its density per area is ``self.scene_data.lamps.choice.evaluate_probability()``.

            L_e · f_r · max(n·ω_i, 0) / p_ω

        Otherwise add two samples: that one, times the weight of the power heuristic, and one whose direction comes from
        ``tt.BRDF.sample_direction(material, w_o, n)``, times its weight. Each weight needs both densities at its own
        direction. ``self.scene_data.lamps.emitted(hit)`` is the light L_e (vec3) that a hit emits.
        """
        radiance = tm.vec3(0)
        ### BEGIN SOLUTION
        hit = self.scene_data.ray_intersector.query_ray(ray)
        if hit.is_hit:
            radiance = self.scene_data.lamps.emitted(hit)
            lights = self.scene_data.lamps.choice
            material = self.scene_data.material_library.materials[hit.material_id]
            n = hit.normal
            w_o = -ray.direction
            x = offset_origin(hit.position, hit.position_error, n)
            for strategy in range(2):
                w_i, triangle_id = lights.sample_mesh_lights(x)
                if strategy == 1:
                    w_i = tt.BRDF.sample_direction(material, w_o, n)
                light_hit = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
                L_e = self.scene_data.lamps.emitted(light_hit)
                if strategy == 0 and light_hit.triangle_id != triangle_id:
                    L_e = tm.vec3(0)
                if L_e.max() > 0:
                    f_cos = tt.BRDF.evaluate_brdf(material, w_o, w_i, n) * ti.max(0.0, tm.dot(n, w_i))
                    cos_light = tm.dot(light_hit.normal, -w_i)
                    p_light = self.to_solid_angle(lights.evaluate_probability(), light_hit.distance, cos_light)
                    p_brdf = tt.BRDF.evaluate_probability(material, w_o, w_i, n)
                    if ti.static(self.active.name == "environment"):
                        if strategy == 0:
                            radiance += L_e * f_cos / p_light
                    elif strategy == 0:
                        radiance += L_e * f_cos / p_light * self.power_heuristic(p_light, p_brdf)
                    elif p_brdf > 0:
                        radiance += L_e * f_cos / p_brdf * self.power_heuristic(p_brdf, p_light)
        ### END SOLUTION
        return radiance
