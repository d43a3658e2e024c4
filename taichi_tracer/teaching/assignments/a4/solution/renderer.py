"""Assignment 4: light that bounces from surface to surface, along paths."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.ray import offset_origin


@ti.data_oriented
class A4Renderer(tt.A4Renderer):
    """A path tracer. ``tt.BRDF`` has the functions of assignment 2, ``self.scene_data.lamps.choice`` those of 3."""

    @ti.func
    def next_throughput(self, throughput, f_r, cosine, pdf):
        """The throughput (vec3) of a path after one more bounce: β · f_r · cos θ / p."""
        new_throughput = tm.vec3(0)
        ### BEGIN SOLUTION
        new_throughput = throughput * f_r * cosine / pdf
        ### END SOLUTION
        return new_throughput

    @ti.func
    def play_roulette(self, throughput, q):
        """Russian roulette: with the probability q, the path ends, and the throughput (vec3) is 0.

        Otherwise, the throughput is divided by the probability with which the path goes on, so that the mean stays.
        """
        new_throughput = tm.vec3(0)
        ### BEGIN SOLUTION
        if ti.random() >= q:
            new_throughput = throughput / (1 - q)
        ### END SOLUTION
        return new_throughput

    @ti.func
    def sample_light(self, hit, x, w_o):
        """The light (vec3) that a surface reflects directly from one random point of the lights, towards w_o.

            L_e · f_r · max(n·ω_i, 0) · cos θ_y / (p_area distance²)

        ``self.scene_data.lamps.emitted(hit)`` is the light L_e (vec3) that a hit emits towards its ray.
        x is a safe origin for rays that leave the surface, ``hit`` what is known of it. Draw ω_i and a triangle from
        ``self.scene_data.lamps.choice.sample_mesh_lights(x)``; p_area is ``evaluate_probability()`` of the same object.
        The light counts only if a ray from x hits this triangle.
        """
        light = tm.vec3(0)
        ### BEGIN SOLUTION
        lights = self.scene_data.lamps.choice
        w_i, triangle_id = lights.sample_mesh_lights(x)
        light_hit = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
        if light_hit.is_hit and light_hit.triangle_id == triangle_id:
            material = self.scene_data.material_library.materials[hit.material_id]
            f_r = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
            cos_surface = ti.max(0.0, tm.dot(hit.normal, w_i))
            cos_light = tm.dot(light_hit.normal, -w_i)
            p_area = lights.evaluate_probability()
            L_e = self.scene_data.lamps.emitted(light_hit)
            light = L_e * f_r * cos_surface * cos_light / (p_area * light_hit.distance**2)
        ### END SOLUTION
        return light

    @ti.func
    def shade_ray(self, ray):
        """The light (vec3) along one random path that begins with an eye ray.

        The path meets a surface, continues in a direction of ``tt.BRDF.sample_direction(material, w_o, n)``, and so on,
        until it hits nothing or was reflected ``self.max_bounces`` times. With 0 bounces, only emitted light is seen.

        If ``self.active.name`` is "implicit", every surface of the path adds what it emits, times the throughput.
        Otherwise, only the first surface adds what it emits, and every surface that may reflect adds
        ``self.sample_light(hit, x, w_o)``, times the throughput. After each bounce, call ``self.play_roulette`` with
        q = ``self.rr_termination_probability``, if there were more than ``self.rr_start_bounce`` bounces.
        """
        radiance = tm.vec3(0)
        ### BEGIN SOLUTION
        throughput = tm.vec3(1)
        current = tt.Ray(origin=ray.origin, direction=ray.direction)
        for bounce in range(self.max_bounces + 1):
            if throughput.max() > 0:
                hit = self.scene_data.ray_intersector.query_ray(current)
                if not hit.is_hit:
                    throughput = tm.vec3(0)
                else:
                    if ti.static(self.active.name == "implicit"):
                        radiance += throughput * self.scene_data.lamps.emitted(hit)
                    elif bounce == 0:
                        radiance += self.scene_data.lamps.emitted(hit)
                    if bounce < self.max_bounces:
                        n = hit.normal
                        w_o = -current.direction
                        material = self.scene_data.material_library.materials[hit.material_id]
                        x = offset_origin(hit.position, hit.position_error, n)
                        if ti.static(self.active.name != "implicit"):
                            radiance += throughput * self.sample_light(hit, x, w_o)
                        w_i = tt.BRDF.sample_direction(material, w_o, n)
                        f_r = tt.BRDF.evaluate_brdf(material, w_o, w_i, n)
                        cosine = ti.max(0.0, tm.dot(n, w_i))
                        pdf = tt.BRDF.evaluate_probability(material, w_o, w_i, n)
                        throughput = self.next_throughput(throughput, f_r, cosine, ti.max(pdf, 1e-8))
                        if bounce + 1 > self.rr_start_bounce:
                            throughput = self.play_roulette(throughput, self.rr_termination_probability)
                        current = tt.Ray(origin=x, direction=w_i)
        ### END SOLUTION
        return radiance
