"""Right solutions that are written differently, as five students would write them.

A text has the methods of one student: the name of each part, and below it the body of its method and helpers.
"""

import re


def methods(text: str) -> dict[str, str]:
    """Part → the body of its method."""
    _, *found = re.split(r"^(\w+\.\w+)\n", text, flags=re.MULTILINE)
    return dict(zip(found[::2], found[1::2], strict=True))


A1_ONE = """
Camera.generate_ndc_coords
        u = (pixel_x + 0.5) / self.width
        v = (pixel_y + 0.5) / self.height
        return tm.vec2(-1 + u + u, -1 + v + v)
Camera.generate_camera_coords
        top = ti.sin(self.fov * (tm.pi / 360)) / ti.cos(self.fov * (tm.pi / 360))
        right = top * (self.width / self.height)
        return tm.vec4(right * ndc_coords.x, top * ndc_coords.y, 1.0, 0.0)
RayIntersector.intersect_triangle
        ids = self.geometry.triangle_vertex_ids[triangle_id]
        v0, v1, v2 = self.geometry.vertices[ids[0]], self.geometry.vertices[ids[1]], self.geometry.vertices[ids[2]]
        edge1, edge2 = v1 - v0, v2 - v0
        h = ray.direction.cross(edge2)
        a = edge1.dot(h)
        hit = tt.HitData()
        if a > self.EPSILON or a < -self.EPSILON:
            f = 1.0 / a
            s = ray.origin - v0
            u = f * s.dot(h)
            if 0.0 <= u <= 1.0:
                q = s.cross(edge1)
                v = f * ray.direction.dot(q)
                if v >= 0.0 and u + v <= 1.0:
                    t = f * edge2.dot(q)
                    if t > self.EPSILON:
                        n = self.geometry.triangle_normal_ids[triangle_id]
                        normal = (1 - u - v) * self.geometry.normals[n[0]] + u * self.geometry.normals[n[1]]
                        normal += v * self.geometry.normals[n[2]]
                        hit.is_hit = True
                        hit.is_backfacing = a < 0
                        hit.triangle_id = triangle_id
                        hit.distance = t
                        hit.barycentric_coords = tm.vec2(u, v)
                        hit.normal = normal.normalized() * (1.0 if a > 0 else -1.0)
                        hit.material_id = self.geometry.triangle_material_ids[triangle_id]
        return hit
"""
A1_TWO = """
Camera.compute_matrix
        forward = np.array(self.at) - np.array(self.eye)
        forward /= np.sqrt(forward @ forward)
        right = np.cross(np.array(self.up), forward)
        right /= np.sqrt(right @ right)
        rows = np.stack([right, np.cross(forward, right), forward, np.array(self.eye)])
        return np.vstack([rows.T, [0, 0, 0, 1]])
Camera.generate_ray
        p = self.generate_camera_coords(self.generate_ndc_coords(pixel_x, pixel_y))
        m = self.camera_to_world[None]
        target = m @ tm.vec4(p.xyz, 1)
        return tt.Ray(origin=self.eye, direction=(target.xyz / target.w - self.eye).normalized())
RayIntersector.query_ray
        best = tt.HitData()
        closest = 1e30
        for i in range(self.geometry.n_triangles):
            candidate = self.intersect_triangle(ray, self.geometry.n_triangles - 1 - i)
            if candidate.is_hit:
                if candidate.distance < closest:
                    closest = candidate.distance
                    best = candidate
        return best
A1Renderer.shade_hit
        front = tm.vec3(1, 1, 1) * hit_data.is_hit
        return ti.select(hit_data.is_backfacing, tm.vec3(0.5, 0, 0), front)
A1Renderer.shade_triangle_id
        return ti.select(hit_data.is_hit != 0, id_color(hit_data.triangle_id), tm.vec3(0.0, 0.0, 0.0))
A1Renderer.shade_normal
        return (0.5 * hit_data.normal + 0.5) * hit_data.is_hit
"""
A1_THREE = """
Camera.generate_ndc_coords
        size = tm.vec2(self.width, self.height)
        return (2 * tm.vec2(pixel_x, pixel_y) + 1 - size) / size
RayIntersector.intersect_triangle
        hit = tt.no_hit()
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        n = tm.cross(v1 - v0, v2 - v0)
        facing = -tm.dot(n, ray.direction)
        if abs(facing) > 1e-9:
            t = tm.dot(ray.origin - v0, n) / facing
            p = ray.origin + t * ray.direction
            area = tm.dot(n, n)
            u = tm.dot(tm.cross(v0 - v2, p - v2), n) / area
            v = tm.dot(tm.cross(v1 - v0, p - v0), n) / area
            w = tm.dot(tm.cross(v2 - v1, p - v1), n) / area
            if t > 0 and ti.min(u, v, w) >= 0:
                ids = self.geometry.triangle_normal_ids[triangle_id]
                normal = w * self.geometry.normals[ids.x] + u * self.geometry.normals[ids.y]
                normal = tm.normalize(normal + v * self.geometry.normals[ids.z])
                hit.is_hit = 1
                hit.is_backfacing = ti.select(facing < 0, 1, 0)
                hit.triangle_id = triangle_id
                hit.distance = t
                hit.barycentric_coords = tm.vec2(u, v)
                hit.normal = ti.select(facing < 0, -normal, normal)
                hit.material_id = self.geometry.triangle_material_ids[triangle_id]
        return hit
A1Renderer.shade_distance
        grey = ti.min(ti.max(hit_data.distance * (1 / self.max_distance), 0), 1)
        return ti.select(hit_data.is_hit, tm.vec3(grey, grey, grey), tm.vec3(0))
"""
A1_FOUR = """
Camera.generate_camera_coords
        half = tm.radians(self.fov) / 2
        y = ndc_coords.y * tm.tan(half)
        x = ndc_coords.x * tm.tan(half) * self.width / self.height
        return tm.vec4(x, y, 1, 0)
Camera.compute_matrix
        z = self.at - self.eye
        z = z / np.linalg.norm(z)
        y = self.up - (self.up @ z) * z
        y = y / np.linalg.norm(y)
        m = np.zeros((4, 4))
        m[:3, 1], m[:3, 2], m[:3, 0], m[:3, 3], m[3, 3] = y, z, np.cross(y, z), self.eye, 1
        return m
RayIntersector.query_ray
        nearest = self.intersect_triangle(ray, 0)
        for i in range(1, self.geometry.n_triangles):
            hit = self.intersect_triangle(ray, i)
            is_nearer = hit.is_hit and (not nearest.is_hit or hit.distance < nearest.distance)
            if is_nearer:
                nearest = hit
        return nearest
"""
A1_FIVE = """
Camera.generate_ray
        c = self.generate_camera_coords(self.generate_ndc_coords(pixel_x, pixel_y))
        m = self.camera_to_world[None]
        d = tm.vec3(0)
        for k in ti.static(range(3)):
            d[k] = m[k, 0] * c.x + m[k, 1] * c.y + m[k, 2] * c.z
        return tt.Ray(self.eye, d / ti.sqrt(d.x**2 + d.y**2 + d.z**2))
RayIntersector.query_ray
        nearest = tt.no_hit()
        t_min = tm.inf
        triangle = -1
        for i in range(self.geometry.n_triangles):
            hit = self.intersect_triangle(ray, i)
            if hit.is_hit and hit.distance < t_min:
                t_min, triangle = hit.distance, i
        if triangle >= 0:
            nearest = self.intersect_triangle(ray, triangle)
        return nearest
A1Renderer.shade_material_id
        return hit_data.is_hit * id_color(ti.max(hit_data.material_id, 0))
A1Renderer.shade_barycentric
        uv = hit_data.barycentric_coords
        return ti.select(hit_data.is_hit != 0, 1, 0) * tm.vec3(uv, 1 - uv.x - uv.y)
"""
A2_ONE = """
BRDF.evaluate_probability
        probability = ti.max(normal.dot(w_i), 0) / tm.pi
        if material.Ns > 1:
            mirrored = tm.normalize(2 * normal.dot(w_o) * normal - w_o)
            probability = (material.Ns + 1) / 2 / tm.pi * ti.exp(material.Ns * ti.log(ti.max(mirrored.dot(w_i), 1e-30)))
        return probability
Environment.query_ray
        d = ray.direction
        u = (ti.atan2(d.z, d.x) / tm.pi + 1.0) * 0.5
        v = ti.asin(tm.clamp(d.y, -1.0, 1.0)) / tm.pi + 0.5
        x = tm.clamp(ti.floor(u * self.width), 0, self.width - 1)
        y = tm.clamp(ti.floor((1.0 - v) * self.height), 0, self.height - 1)
        return self.texels[ti.cast(y, int), ti.cast(x, int)]
Camera.generate_ndc_coords
        x, y = pixel_x + 0.5, pixel_y + 0.5
        if jitter:
            y += ti.random() - 0.5
            x += ti.random() - 0.5
        return tm.vec2(2 * x / self.width - 1, 2 * y / self.height - 1)
A2Renderer.running_mean
        return mean + (sample - mean) / (count + 1)
UniformSampler.sample_direction
        phi = 2 * tm.pi * ti.random()
        y = 1 - 2 * ti.random()
        r = ti.sqrt(ti.max(0.0, 1 - y**2))
        return tm.vec3(r * ti.sin(phi), y, r * ti.cos(phi))
BRDF.evaluate_brdf
        value = material.Kd / tm.pi
        if material.Ns > 1:
            w_r = -tm.reflect(w_o, normal)
            value = (material.Ns + 1) / (2 * tm.pi) * material.Kd * ti.max(tm.dot(w_r, w_i), 0.0) ** material.Ns
        return value
"""
A2_TWO = """
Camera.generate_ndc_coords
        offset = tm.vec2(0.5)
        if jitter:
            offset = tm.vec2(ti.random(), ti.random())
        return 2.0 * (tm.vec2(pixel_x, pixel_y) + offset) / tm.vec2(self.width, self.height) - 1.0
UniformSampler.sample_direction
        p = tm.vec3(2)
        while p.norm() > 1 or p.norm() < 1e-3:
            p = 2 * tm.vec3(ti.random(), ti.random(), ti.random()) - 1
        return p.normalized()
BRDF.sample_direction
        axis, exponent = normal, 1.0
        if material.Ns > 1:
            axis, exponent = -tm.reflect(w_o, normal), material.Ns
        helper = tm.vec3(0, 0, 1)
        if abs(axis.z) > 0.7:
            helper = tm.vec3(1, 0, 0)
        x = tm.normalize(helper - tm.dot(helper, axis) * axis)
        y = tm.cross(axis, x)
        cos_theta = (1 - ti.random()) ** (1 / (exponent + 1))
        angle = tm.pi * (2 * ti.random() - 1)
        sin_theta = ti.sqrt(1 - cos_theta**2)
        return tm.normalize(x * sin_theta * ti.cos(angle) + y * sin_theta * ti.sin(angle) + axis * cos_theta)
Environment.query_ray
        d = ray.direction.normalized()
        phi = ti.atan2(d.z, d.x) + tm.pi
        theta = ti.acos(ti.max(-1.0, ti.min(1.0, d.y)))
        i = ti.cast(phi / (2 * tm.pi) * self.width, ti.i32) % self.width
        j = ti.cast(theta / tm.pi * self.height, ti.i32)
        return self.texels[ti.min(j, self.height - 1), i]
"""
A2_THREE = """
BRDF.sample_direction
        w_i = normal
        if material.Ns > 1:
            w_r = 2 * tm.dot(normal, w_o) * normal - w_o
            sign = ti.select(w_r.z >= 0, 1.0, -1.0)
            a = -1 / (sign + w_r.z)
            b = w_r.x * w_r.y * a
            t1 = tm.vec3(1 + sign * w_r.x * w_r.x * a, sign * b, -sign * w_r.x)
            t2 = tm.vec3(b, sign + w_r.y * w_r.y * a, -w_r.y)
            z = ti.random() ** (1 / (material.Ns + 1))
            phi = 2 * tm.pi * ti.random()
            w_i = ti.sqrt(1 - z * z) * (ti.cos(phi) * t1 + ti.sin(phi) * t2) + z * w_r
        else:
            z = 2 * ti.random() - 1
            phi = 2 * tm.pi * ti.random()
            r = ti.sqrt(1 - z * z)
            w_i = tm.normalize(normal * 1.000001 + tm.vec3(r * ti.cos(phi), r * ti.sin(phi), z))
        return w_i
A2Renderer.running_mean
        return mean * (count / (count + 1)) + sample / (count + 1)
A2Renderer.shade_ray
        scene = self.scene_data
        light = scene.environment.query_ray(ray)
        hit = scene.ray_intersector.query_ray(ray)
        if hit.is_hit:
            light = tm.vec3(0)
            material = scene.material_library.materials[hit.material_id]
            direction = UniformSampler.sample_direction()
            pdf = UniformSampler.evaluate_probability()
            if ti.static(self.active.name != "uniform"):
                direction = BRDF.sample_direction(material, -ray.direction, hit.normal)
                pdf = BRDF.evaluate_probability(material, -ray.direction, direction, hit.normal)
            cosine = tm.dot(hit.normal, direction)
            if cosine > 0 and pdf > 0:
                f = BRDF.evaluate_brdf(material, -ray.direction, direction, hit.normal)
                shadow = tt.Ray(hit.position + 1e-4 * hit.normal, direction)
                if not scene.ray_intersector.query_ray(shadow).is_hit:
                    light = scene.environment.query_ray(shadow) * f * cosine / pdf
        return light
"""
A2_FOUR = """
A2Renderer.shade_ray
        radiance = tm.vec3(0)
        hit = self.scene_data.ray_intersector.query_ray(ray)
        if not hit.is_hit:
            radiance = self.scene_data.environment.query_ray(ray)
        else:
            material = self.scene_data.material_library.materials[hit.material_id]
            w_o = -ray.direction
            w_i = tm.vec3(0)
            weight = tm.vec3(0)
            if ti.static(self.active.name == "uniform"):
                w_i = UniformSampler.sample_direction()
                cosine = ti.max(hit.normal.dot(w_i), 0)
                weight = 4 * tm.pi * cosine * BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
            else:
                w_i = BRDF.sample_direction(material, w_o, hit.normal)
                weight = BRDF.evaluate_brdf_factor(material, w_o, w_i, hit.normal)
            shadow_ray = tt.Ray(offset_origin(hit.position, hit.position_error, hit.normal), w_i)
            if weight.max() > 0 and not self.scene_data.ray_intersector.query_ray(shadow_ray).is_hit:
                radiance = weight * self.scene_data.environment.query_ray(shadow_ray)
        return radiance
BRDF.evaluate_brdf
        w_r = tm.normalize(2 * tm.dot(w_o, normal) * normal - w_o)
        lobe = (material.Ns + 1) / (2 * tm.pi) * ti.pow(ti.max(0.0, w_r.dot(w_i)), material.Ns)
        return material.Kd * ti.select(material.Ns > 1, lobe, 1 / tm.pi)
BRDF.evaluate_brdf_factor
        factor = material.Kd
        if material.Ns > 1:
            factor = material.Kd * tm.clamp(normal.dot(w_i), 0.0, 1.0)
        return factor
Camera.generate_ray
        c = self.generate_camera_coords(self.generate_ndc_coords(pixel_x, pixel_y, jitter))
        return tt.Ray(origin=self.eye, direction=(self.camera_to_world[None] @ c).xyz.normalized())
BRDF.evaluate_probability
        pdf = tm.max(tm.dot(w_i, normal), 0.0) / tm.pi
        if material.Ns > 1:
            half = ti.max(tm.dot(2 * normal * tm.dot(w_o, normal) - w_o, w_i), 0.0)
            pdf = (1 + material.Ns) * half**material.Ns / 2 / tm.pi
        return pdf
"""
A2_FIVE = """
BRDF.evaluate_brdf_factor
        cosine = ti.max(tm.dot(w_i, normal), 0.0)
        return ti.select(material.Ns > 1, material.Kd * cosine, material.Kd)
UniformSampler.evaluate_probability
        return 0.25 / tm.pi
UniformSampler.sample_direction
        a, b, c = ti.randn(), ti.randn(), ti.randn()
        return tm.normalize(tm.vec3(a, b, c))
MicrofacetBRDF.sample_direction
        frame = ortho_frames(normal)
        o = tm.normalize(frame.transpose() @ w_o)
        v = tm.normalize(tm.vec3(material.alpha_x * o.x, material.alpha_y * o.y, o.z))
        side = ortho_frames(v)
        radius, angle = ti.sqrt(ti.random()), 2 * tm.pi * ti.random()
        disk = tm.vec2(radius * ti.cos(angle), radius * ti.sin(angle))
        up = v.z * v - tm.vec3(0, 0, 1)
        n = disk.x * side[:, 0] + disk.y * side[:, 1] + ti.sqrt(ti.max(0.0, 1 - radius**2)) * v
        if up.norm() > 1e-6:
            side_y = -tm.normalize(up)
            side_x = tm.cross(side_y, v)
            s = (1 + v.z) / 2
            y = (1 - s) * ti.sqrt(1 - disk.x**2) + s * disk.y
            n = disk.x * side_x + y * side_y + ti.sqrt(ti.max(0.0, 1 - disk.x**2 - y**2)) * v
        m = tm.normalize(tm.vec3(material.alpha_x * n.x, material.alpha_y * n.y, ti.max(n.z, 0.0)))
        return frame @ (-tm.reflect(o, m))
MicrofacetBRDF.evaluate_probability
        m = (w_o + w_i).normalized()
        cos_m, cos_o = m.dot(normal), w_o.dot(normal)
        a2 = material.alpha_x * material.alpha_y
        D = a2 / (tm.pi * (cos_m**2 * (a2 - 1) + 1) ** 2)
        G1 = 2 * cos_o / (cos_o + ti.sqrt(a2 + (1 - a2) * cos_o**2))
        return G1 * D / (4 * cos_o)
MicrofacetBRDF.evaluate_brdf
        m = (w_o + w_i).normalized()
        cos_m, cos_o, cos_i = m.dot(normal), w_o.dot(normal), w_i.dot(normal)
        a2 = material.alpha_x * material.alpha_y
        D = a2 / (tm.pi * (cos_m**2 * (a2 - 1) + 1) ** 2)
        s_o, s_i = ti.sqrt(a2 + (1 - a2) * cos_o**2), ti.sqrt(a2 + (1 - a2) * cos_i**2)
        c = 1 - m.dot(w_o)
        F = material.F0 + (1 - material.F0) * c * c * c * c * c
        return F * D / (2 * (cos_i * s_o + cos_o * s_i))
MicrofacetBRDF.evaluate_brdf_factor
        cos_o, cos_i = w_o.dot(normal), w_i.dot(normal)
        a2 = material.alpha_x * material.alpha_y
        s_o, s_i = ti.sqrt(a2 + (1 - a2) * cos_o**2), ti.sqrt(a2 + (1 - a2) * cos_i**2)
        c = 1 - w_o.dot((w_o + w_i).normalized())
        F = material.F0 + (1 - material.F0) * c**5
        return F * cos_i * (cos_o + s_o) / (cos_i * s_o + cos_o * s_i)
"""
A3_ONE = """
MeshLightSampler.compute_triangle_area
        return 0.5 * tm.length(tm.cross(v0 - v2, v1 - v2))
MeshLightSampler.compute_cdf
        for i in range(self.n_emissive_triangles):
            total = 0.0
            for j in range(i + 1):
                total += self.areas[j]
            self.cdf[i] = total / self.total_area
MeshLightSampler.sample_emissive_triangle
        xi = ti.random()
        i = 0
        while i < self.n_emissive_triangles - 1 and xi >= self.cdf[i]:
            i += 1
        return i
MeshLightSampler.evaluate_probability
        return 1.0 / self.total_area
MeshLightSampler.sample_mesh_lights
        i = self.sample_emissive_triangle()
        triangle = self.emissive_triangle_ids[i]
        a, b, c = self.geometry.triangle(triangle)
        root = ti.sqrt(ti.random())
        v = ti.random()
        point = (1 - root) * a + root * (1 - v) * b + root * v * c
        to_light = point - hit_point
        return to_light / to_light.norm(), triangle
A3Renderer.to_solid_angle
        d2 = distance * distance
        return pdf_area * d2 * (1.0 / cos_light)
A3Renderer.power_heuristic
        f = pdf * pdf
        g = other_pdf * other_pdf
        return f / (f + g)
A3Renderer.shade_ray
        scene = self.scene_data
        colour = tm.vec3(0.0, 0.0, 0.0)
        hit = scene.ray_intersector.query_ray(ray)
        if hit.is_hit:
            colour += self.emitted(hit)
            mat = scene.material_library.materials[hit.material_id]
            n, wo = hit.normal, -ray.direction
            origin = offset_origin(hit.position, hit.position_error, n)
            # the lights
            wi, light_id = scene.lamps.choice.sample_mesh_lights(origin)
            shadow = scene.ray_intersector.query_ray(tt.Ray(origin, wi))
            if shadow.is_hit and shadow.triangle_id == light_id and not shadow.is_backfacing and tm.dot(n, wi) > 0:
                p_area = scene.lamps.choice.evaluate_probability()
                p_light = self.to_solid_angle(p_area, shadow.distance, tm.dot(shadow.normal, -wi))
                light = self.emitted(shadow) * tt.BRDF.evaluate_brdf(mat, wo, wi, n) * tm.dot(n, wi) / p_light
                if ti.static(self.active.name == "mis"):
                    light *= self.power_heuristic(p_light, tt.BRDF.evaluate_probability(mat, wo, wi, n))
                colour += light
            # the BRDF
            if ti.static(self.active.name == "mis"):
                wi = tt.BRDF.sample_direction(mat, wo, n)
                p_brdf = tt.BRDF.evaluate_probability(mat, wo, wi, n)
                found = scene.ray_intersector.query_ray(tt.Ray(origin, wi))
                if found.is_hit and not found.is_backfacing and tm.dot(n, wi) > 0 and p_brdf > 0:
                    p_area = scene.lamps.choice.evaluate_probability()
                    p_light = self.to_solid_angle(p_area, found.distance, tm.dot(found.normal, -wi))
                    light = self.emitted(found) * tt.BRDF.evaluate_brdf(mat, wo, wi, n) * tm.dot(n, wi) / p_brdf
                    colour += light * self.power_heuristic(p_brdf, p_light)
        return colour
EnvironmentSampler.compute_probabilities
        height, width, _ = image.shape
        weights = np.zeros((height, width))
        for row in range(height):
            for column in range(width):
                r, g, b = image[row, column]
                weights[row, column] = (0.2126 * r + 0.7152 * g + 0.0722 * b) * np.sin(np.pi * (row + 0.5) / height)
        return weights / np.sum(weights)
EnvironmentSampler.evaluate_density
        height, width = probabilities.shape
        density = np.empty((height, width))
        for row in range(height):
            sine = np.sin(np.pi * (row + 0.5) / height)
            density[row] = probabilities[row] * width * height / (2 * np.pi**2 * sine)
        return density
Environment.precompute_scalar
        for x, y in ti.ndrange(self.x_resolution, self.y_resolution):
            c = self.image[x, y]
            latitude = (y + 0.5) / self.y_resolution - 0.5
            self.image_scalar[x, y] = ti.cos(tm.pi * latitude) * (0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b)
Environment.importance_sample_envmap
        u1, u2 = ti.random(), ti.random()
        row, low, high = 0, 0, self.y_resolution - 1
        while low < high:
            middle = (low + high) // 2
            if self.cdf_ptheta[middle] > u1:
                high = middle
            else:
                low = middle + 1
        row = low
        column = 0
        for i in range(self.x_resolution - 1):
            if self.cdf_p_phi_given_theta[i, row] <= u2:
                column = i + 1
        return tm.vec2(column + ti.random(), row + ti.random()) / tm.vec2(self.x_resolution, self.y_resolution)
"""
A3_TWO = """
MeshLightSampler.compute_triangle_area
        e1, e2 = v1 - v0, v2 - v0
        return ti.sqrt(ti.max(e1.dot(e1) * e2.dot(e2) - e1.dot(e2) ** 2, 0.0)) / 2
MeshLightSampler.compute_cdf
        self.cdf[0] = self.areas[0] / self.total_area
        ti.loop_config(serialize=True)
        for i in range(1, self.n_emissive_triangles):
            self.cdf[i] = self.cdf[i - 1] + self.areas[i] / self.total_area
MeshLightSampler.sample_emissive_triangle
        xi = ti.random()
        chosen = 0
        for k in range(self.n_emissive_triangles - 1):
            if xi >= self.cdf[k]:
                chosen = k + 1
        return chosen
MeshLightSampler.evaluate_probability
        area = 0.0
        for k in range(self.n_emissive_triangles):
            area += self.areas[k]
        return 1 / area
MeshLightSampler.sample_mesh_lights
        triangle_id = self.emissive_triangle_ids[self.sample_emissive_triangle()]
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        s, t = ti.random(), ti.random()
        if s + t > 1.0:
            s, t = 1.0 - s, 1.0 - t
        y = v0 + s * (v1 - v0) + t * (v2 - v0)
        return (y - hit_point).normalized(), triangle_id
A3Renderer.to_solid_angle
        return pdf_area / (cos_light / ti.pow(distance, 2))
A3Renderer.power_heuristic
        ratio = other_pdf / pdf
        return 1.0 / (1.0 + ratio * ratio)
A3Renderer.shade_ray
        radiance = tm.vec3(0.0)
        hit = self.scene_data.ray_intersector.query_ray(ray)
        if hit.is_hit:
            radiance = self.emitted(hit) + self.from_lights(ray, hit)
            if ti.static(self.active.name != "environment"):
                radiance += self.from_brdf(ray, hit)
        return radiance

    @ti.func
    def from_lights(self, ray, hit):
        result = tm.vec3(0.0)
        material = self.scene_data.material_library.materials[hit.material_id]
        x = offset_origin(hit.position, hit.position_error, hit.normal)
        w_i, triangle_id = self.scene_data.lamps.choice.sample_mesh_lights(x)
        y = self.seen_from(hit, w_i)
        cos_x, cos_y = tm.dot(hit.normal, w_i), -tm.dot(y.normal, w_i)
        if y.is_hit and y.triangle_id == triangle_id and cos_x > 0 and not y.is_backfacing:
            p_area = self.scene_data.lamps.choice.evaluate_probability()
            f_r = tt.BRDF.evaluate_brdf(material, -ray.direction, w_i, hit.normal)
            result = self.emitted(y) * f_r * cos_x * cos_y / (p_area * y.distance**2)
            if ti.static(self.active.name != "environment"):
                q = tt.BRDF.evaluate_probability(material, -ray.direction, w_i, hit.normal)
                result = result * self.power_heuristic(p_area * y.distance**2 / cos_y, q)
        return result

    @ti.func
    def seen_from(self, hit, w_i):
        x = offset_origin(hit.position, hit.position_error, hit.normal)
        return self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))

    @ti.func
    def from_brdf(self, ray, hit):
        result = tm.vec3(0.0)
        material = self.scene_data.material_library.materials[hit.material_id]
        w_i = tt.BRDF.sample_direction(material, -ray.direction, hit.normal)
        y = self.seen_from(hit, w_i)
        cos_y = -tm.dot(y.normal, w_i)
        if y.is_hit and not y.is_backfacing and self.emitted(y).sum() > 0:
            q = tt.BRDF.evaluate_probability(material, -ray.direction, w_i, hit.normal)
            p = self.to_solid_angle(self.scene_data.lamps.choice.evaluate_probability(), y.distance, cos_y)
            if q > 0:
                factor = tt.BRDF.evaluate_brdf_factor(material, -ray.direction, w_i, hit.normal)
                result = self.emitted(y) * factor * self.power_heuristic(q, p)
        return result
EnvironmentSampler.compute_probabilities
        height = image.shape[0]
        red, green, blue = np.moveaxis(image, 2, 0)
        light = 0.2126 * red + 0.7152 * green + 0.0722 * blue
        angles = np.linspace(0.5, height - 0.5, height) * np.pi / height
        light = light * np.sin(angles).reshape(-1, 1)
        return light / light.sum()
EnvironmentSampler.evaluate_density
        height, width = probabilities.shape
        d_phi, d_theta = 2 * np.pi / width, np.pi / height
        rows = (np.arange(height) + 0.5) * d_theta
        return probabilities / (d_phi * d_theta * np.tile(np.sin(rows)[:, None], (1, width)))
Environment.precompute_scalar
        for x in range(self.x_resolution):
            for y in range(self.y_resolution):
                sin_theta = tm.sin((2 * y + 1) * tm.pi / (2 * self.y_resolution))
                self.image_scalar[x, y] = self.image[x, y].dot(tm.vec3([0.2126, 0.7152, 0.0722])) * sin_theta
Environment.importance_sample_envmap
        p, q = ti.random(), ti.random()
        y = 0
        while self.cdf_ptheta[y] < p and y + 1 < self.y_resolution:
            p0 = self.cdf_ptheta[y]
            y += 1
        p0 = ti.select(y > 0, self.cdf_ptheta[ti.max(y - 1, 0)], 0.0)
        x = 0
        while self.cdf_p_phi_given_theta[x, y] < q and x + 1 < self.x_resolution:
            x += 1
        q0 = ti.select(x > 0, self.cdf_p_phi_given_theta[ti.max(x - 1, 0), y], 0.0)
        v = y + (p - p0) / (self.cdf_ptheta[y] - p0)
        u = x + (q - q0) / (self.cdf_p_phi_given_theta[x, y] - q0)
        return tm.vec2([u / float(self.x_resolution), v / float(self.y_resolution)])
"""
A3_THREE = """
MeshLightSampler.compute_triangle_area
        a = v1 - v0
        b = v2 - v0
        x = a.y * b.z - a.z * b.y
        y = a.z * b.x - a.x * b.z
        z = a.x * b.y - a.y * b.x
        return 0.5 * ti.sqrt(x * x + y * y + z * z)
MeshLightSampler.compute_cdf
        for i in self.cdf:
            below = ti.cast(0.0, ti.f64)
            for j in range(self.n_emissive_triangles):
                if j <= i:
                    below += self.areas[j]
            self.cdf[i] = ti.cast(below / self.total_area, ti.f32)
MeshLightSampler.sample_emissive_triangle
        xi, index = ti.random(), 0
        for k in range(self.n_emissive_triangles - 1):
            index += ti.cast(xi >= self.cdf[k], ti.i32)
        return index
MeshLightSampler.evaluate_probability
        i = self.n_emissive_triangles - 1
        before = 0.0
        if i > 0:
            before = self.cdf[i - 1]
        return (self.cdf[i] - before) / self.areas[i]
MeshLightSampler.sample_mesh_lights
        triangle_id = self.emissive_triangle_ids[self.sample_emissive_triangle()]
        corners = self.geometry.triangle(triangle_id)
        weights = tm.vec3(1, 1, 1)
        while weights.x + weights.y > 1:
            weights.x = ti.random()
            weights.y = ti.random()
        weights.z = 1 - weights.x - weights.y
        y = tm.vec3(0)
        for k in ti.static(range(3)):
            y += weights[k] * corners[k]
        return tm.normalize(y - hit_point), triangle_id
A3Renderer.to_solid_angle
        geometry = ti.abs(cos_light) / distance / distance
        return pdf_area / geometry
A3Renderer.power_heuristic
        total = pdf + other_pdf
        p, q = pdf / total, other_pdf / total
        return p * p / (p * p + q * q)
A3Renderer.shade_ray
        total = tm.vec3(0)
        hit = self.scene_data.ray_intersector.query_ray(ray)
        if hit.is_hit:
            total += self.emitted(hit)
            m = self.scene_data.material_library.materials[hit.material_id]
            x = offset_origin(hit.position, hit.position_error, hit.normal)
            for strategy in ti.static(range(2)):
                if ti.static(strategy == 0 or self.active.name != "environment"):
                    w_i, chosen = self.scene_data.lamps.choice.sample_mesh_lights(x)
                    if ti.static(strategy == 1):
                        w_i = tt.BRDF.sample_direction(m, -ray.direction, hit.normal)
                    y = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
                    is_found = y.is_hit
                    if ti.static(strategy == 0):
                        is_found = is_found and y.triangle_id == chosen
                    cosine = tm.dot(hit.normal, w_i)
                    if is_found and cosine > 0:
                        p_area = self.scene_data.lamps.choice.evaluate_probability()
                        pdf = tm.vec2(0, 0)
                        pdf[0] = self.to_solid_angle(p_area, y.distance, ti.max(tm.dot(y.normal, -w_i), 1e-6))
                        pdf[1] = tt.BRDF.evaluate_probability(m, -ray.direction, w_i, hit.normal)
                        weight = 1.0
                        if ti.static(self.active.name != "environment"):
                            weight = self.power_heuristic(pdf[strategy], pdf[1 - strategy])
                        f_r = tt.BRDF.evaluate_brdf(m, -ray.direction, w_i, hit.normal)
                        if pdf[strategy] > 0:
                            total += weight * cosine * f_r * self.emitted(y) / pdf[strategy]
        return total
EnvironmentSampler.compute_probabilities
        image = image.astype(np.float32)
        height = image.shape[0]
        luminance = np.einsum("ijk,k->ij", image, np.array([0.2126, 0.7152, 0.0722], np.float32))
        theta = ((np.arange(height) + 0.5) / height * np.pi).astype(np.float32)
        weights = luminance * np.sin(theta)[:, np.newaxis]
        return weights * (1 / weights.sum())
EnvironmentSampler.evaluate_density
        height, width = probabilities.shape
        theta = np.float32(np.pi) * (np.arange(height, dtype=np.float32) + np.float32(0.5)) / np.float32(height)
        area = np.float32(2 * np.pi**2 / (width * height)) * np.sin(theta)
        return (probabilities.astype(np.float32).T / area).T
Environment.precompute_scalar
        for x, y in self.image_scalar:
            theta = tm.pi - tm.pi * (y + 0.5) / self.y_resolution
            r, g, b = self.image[x, y].r, self.image[x, y].g, self.image[x, y].b
            self.image_scalar[x, y] = 10 * tm.sin(theta) * (0.2126 * r + 0.7152 * g + 0.0722 * b)
Environment.importance_sample_envmap
        xi = tm.vec2(ti.random(), ti.random())
        texel = ti.Vector([0, 0])
        for y in range(self.y_resolution - 1):
            texel.y += int(self.cdf_ptheta[y] <= xi.y)
        for x in range(self.x_resolution - 1):
            texel.x += int(self.cdf_p_phi_given_theta[x, texel.y] <= xi.x)
        return (texel + tm.vec2(ti.random(), ti.random())) / ti.Vector([self.x_resolution, self.y_resolution])
"""
A3_FOUR = """
MeshLightSampler.compute_triangle_area
        a, b, c = (v1 - v0).norm(), (v2 - v1).norm(), (v0 - v2).norm()
        longest, shortest = ti.max(a, b, c), ti.min(a, b, c)
        middle = a + b + c - longest - shortest
        product = (longest + (middle + shortest)) * (shortest - (longest - middle))
        product *= (shortest + (longest - middle)) * (longest + (middle - shortest))
        return ti.sqrt(ti.max(product, 0.0)) / 4
MeshLightSampler.compute_cdf
        for _ in range(1):
            sum_of_areas = 0.0
            for i in range(self.n_emissive_triangles):
                sum_of_areas += self.areas[i]
                self.cdf[i] = sum_of_areas
            for i in range(self.n_emissive_triangles):
                self.cdf[i] /= sum_of_areas
MeshLightSampler.sample_emissive_triangle
        xi = ti.random()
        first, after = 0, self.n_emissive_triangles
        while after - first > 1:
            half = first + (after - first) // 2
            if self.cdf[half - 1] <= xi:
                first = half
            else:
                after = half
        return first
MeshLightSampler.sample_mesh_lights
        index = self.sample_emissive_triangle()
        triangle_id = self.emissive_triangle_ids[index]
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        a, b = ti.random(), ti.random()
        low, high = ti.min(a, b), ti.max(a, b)
        y = low * v0 + (high - low) * v1 + (1 - high) * v2
        d = y - hit_point
        d /= ti.sqrt(d.x * d.x + d.y * d.y + d.z * d.z)
        return d, triangle_id
A3Renderer.power_heuristic
        return 1 - other_pdf**2 / (pdf**2 + other_pdf**2)
A3Renderer.shade_ray
        radiance = tm.vec3(0)
        hit = self.scene_data.ray_intersector.query_ray(ray)
        if not hit.is_hit:
            pass
        else:
            radiance += self.emitted(hit)
            lights = self.scene_data.lamps.choice
            material = self.scene_data.material_library.materials[hit.material_id]
            w_o = -tm.normalize(ray.direction)
            x = hit.position + 1e-4 * hit.normal
            if ti.static(self.active.name != "environment"):
                w_i = tt.BRDF.sample_direction(material, w_o, hit.normal)
                light_hit = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
                pdf = tt.BRDF.evaluate_probability(material, w_o, w_i, hit.normal)
                if light_hit.is_hit and self.emitted(light_hit).norm() > 0 and pdf > 0:
                    cos_light = abs(tm.dot(light_hit.normal, w_i))
                    other = self.to_solid_angle(lights.evaluate_probability(), light_hit.distance, cos_light)
                    f = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal) * ti.max(0.0, tm.dot(hit.normal, w_i))
                    radiance += self.power_heuristic(pdf, other) / pdf * f * self.emitted(light_hit)
            w_i, triangle_id = lights.sample_mesh_lights(x)
            light_hit = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
            is_visible = light_hit.is_hit and light_hit.triangle_id == triangle_id
            cos_light = tm.dot(light_hit.normal, -w_i)
            if is_visible and cos_light > 0:
                pdf = self.to_solid_angle(lights.evaluate_probability(), light_hit.distance, cos_light)
                weight = 1.0
                if ti.static(self.active.name != "environment"):
                    weight = self.power_heuristic(pdf, tt.BRDF.evaluate_probability(material, w_o, w_i, hit.normal))
                f = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
                radiance += f * self.emitted(light_hit) * ti.max(tm.dot(w_i, hit.normal), 0.0) * weight / pdf
        return radiance
EnvironmentSampler.compute_probabilities
        height, width = image.shape[:2]
        cos_edges = np.cos(np.pi * np.arange(height + 1) / height)
        solid_angle = cos_edges[:-1] - cos_edges[1:]  # of a row: in proportion to the sine in its middle
        weights = (image * [0.2126, 0.7152, 0.0722]).sum(-1) * solid_angle[:, None]
        return weights / weights.sum()
"""
A3_FIVE = """
MeshLightSampler.sample_emissive_triangle
        chosen, area = 0, 0.0
        for k in range(self.n_emissive_triangles):
            area += self.areas[k]
            if ti.random() * area < self.areas[k]:
                chosen = k
        return chosen
MeshLightSampler.sample_mesh_lights
        triangle_id = self.emissive_triangle_ids[self.sample_emissive_triangle()]
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        weights = -ti.log(1 - tm.vec3(ti.random(), ti.random(), ti.random()))
        weights /= weights.x + weights.y + weights.z
        y = ti.Matrix.cols([v0, v1, v2]) @ weights
        return tm.normalize(y - hit_point), triangle_id
A3Renderer.to_solid_angle
        logarithm = ti.log(pdf_area) + 2 * ti.log(distance) - ti.log(cos_light)
        return ti.exp(logarithm)
A3Renderer.power_heuristic
        weight = 0.0
        if pdf > 0:
            weight = ti.pow(pdf, 2.0) / (ti.pow(pdf, 2.0) + ti.pow(other_pdf, 2.0))
        return weight
A3Renderer.shade_ray
        light = tm.vec3(0)
        first = self.scene_data.ray_intersector.query_ray(ray)
        if first.is_hit:
            light = self.emitted(first)
            origin = offset_origin(first.position, first.position_error, first.normal)
            lamp = self.scene_data.lamps.choice
            density = lamp.evaluate_probability()
            direction, id_of_triangle = lamp.sample_mesh_lights(origin)
            for k in range(2):
                shadow_ray = tt.Ray(origin=origin, direction=direction)
                second = self.scene_data.ray_intersector.query_ray(shadow_ray)
                counts = second.is_hit != 0
                if k == 0 and second.triangle_id != id_of_triangle:
                    counts = False
                if k == 1 and ti.static(self.active.name == "environment"):
                    counts = False
                light += counts * self.contribution(ray, first, second, direction, density, k)
                material = self.scene_data.material_library.materials[first.material_id]
                direction = tt.BRDF.sample_direction(material, -ray.direction, first.normal)
        return light

    @ti.func
    def contribution(self, ray, first, second, w_i, density, k):
        value = tm.vec3(0)
        if tm.dot(first.normal, w_i) > 0 and self.emitted(second).max() > 0:
            material = self.scene_data.material_library.materials[first.material_id]
            p0 = self.to_solid_angle(density, second.distance, -tm.dot(second.normal, w_i))
            p1 = tt.BRDF.evaluate_probability(material, -ray.direction, w_i, first.normal)
            f = tt.BRDF.evaluate_brdf(material, -ray.direction, w_i, first.normal)
            value = self.emitted(second) * f * tm.dot(first.normal, w_i)
            if ti.static(self.active.name == "environment"):
                value /= p0
            elif k == 0:
                value *= p0 / (p0 * p0 + p1 * p1)
            else:
                value *= p1 / (p0 * p0 + p1 * p1)
        return value
EnvironmentSampler.evaluate_density
        h, w = probabilities.shape
        sines = np.array([np.sin(np.pi * (k + 0.5) / h) for k in range(h)])
        pixels = h * w
        return np.einsum("ij,i->ij", probabilities, pixels / (2 * np.pi * np.pi * sines))
"""
A4_ONE = """
A4Renderer.next_throughput
        return f_r * (cosine / pdf) * throughput
A4Renderer.play_roulette
        result = tm.vec3(0.0, 0.0, 0.0)
        survival = 1.0 - q
        if ti.random() < survival:
            result = throughput / survival
        return result
A4Renderer.sample_light
        material = self.scene_data.material_library.materials[hit.material_id]
        w_i, lamp_id = self.scene_data.lamps.choice.sample_mesh_lights(x)
        y = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
        visible = ti.select(y.is_hit != 0 and y.triangle_id == lamp_id, 1.0, 0.0)
        cos_x = ti.max(tm.dot(hit.normal, w_i), 0)
        cos_y = ti.max(tm.dot(y.normal, -w_i), 0)
        f_r = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
        r2 = ti.max(y.distance * y.distance, 1e-12)
        p_area = self.scene_data.lamps.choice.evaluate_probability()
        return visible * self.emitted(y) * f_r * (cos_x * cos_y / r2) / p_area
A4Renderer.shade_ray
        scene = self.scene_data
        L = tm.vec3(0)
        beta = tm.vec3(1)
        o, d = ray.origin, ray.direction
        depth = 0
        while depth <= self.max_bounces:
            hit = scene.ray_intersector.query_ray(tt.Ray(origin=o, direction=d))
            if not hit.is_hit:
                break
            if ti.static(self.active.name == "implicit"):
                L += beta * self.emitted(hit)
            else:
                if depth == 0:
                    L += self.emitted(hit)
            if depth == self.max_bounces:
                break
            m = scene.material_library.materials[hit.material_id]
            x = offset_origin(hit.position, hit.position_error, hit.normal)
            if ti.static(self.active.name != "implicit"):
                L += beta * self.sample_light(hit, x, -d)
            w = tt.BRDF.sample_direction(m, -d, hit.normal)
            pdf = tt.BRDF.evaluate_probability(m, -d, w, hit.normal)
            if pdf <= 0:
                break
            f = tt.BRDF.evaluate_brdf(m, -d, w, hit.normal)
            beta = self.next_throughput(beta, f, ti.max(tm.dot(w, hit.normal), 0.0), pdf)
            depth += 1
            if depth > self.rr_start_bounce:
                beta = self.play_roulette(beta, self.rr_termination_probability)
            if beta.max() <= 0:
                break
            o, d = x, w
        return L
"""
A4_TWO = """
A4Renderer.next_throughput
        new_throughput = tm.vec3(0)
        for k in ti.static(range(3)):
            new_throughput[k] = throughput[k] * f_r[k] / pdf * cosine
        return new_throughput
A4Renderer.play_roulette
        ends = ti.random() < q
        return ti.select(ends, tm.vec3(0), throughput / (1 - q))
A4Renderer.sample_light
        choice = self.scene_data.lamps.choice
        w_i, triangle_id = choice.sample_mesh_lights(x)
        seen = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
        light = tm.vec3(0)
        cosine = tm.dot(hit.normal, w_i)
        if cosine > 0:
            if seen.is_hit and seen.triangle_id == triangle_id and not seen.is_backfacing:
                cos_light = -tm.dot(seen.normal, w_i)
                pdf = choice.evaluate_probability() * seen.distance**2 / cos_light  # per solid angle
                m = self.scene_data.material_library.materials[hit.material_id]
                light = m.Ke * 0 + self.emitted(seen) * tt.BRDF.evaluate_brdf(m, w_o, w_i, hit.normal) * cosine / pdf
        return light
A4Renderer.shade_ray
        radiance = tm.vec3(0)
        if ti.static(self.active.name == "implicit"):
            radiance = self.path(ray, True)
        else:
            radiance = self.path(ray, False)
        return radiance

    @ti.func
    def path(self, ray, is_implicit: ti.template()):
        radiance, weight = tm.vec3(0), tm.vec3(1)
        origin, direction = ray.origin, ray.direction
        goes_on = True
        for k in range(self.max_bounces + 1):
            if goes_on:
                hit = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=origin, direction=direction))
                goes_on = hit.is_hit != 0 and k < self.max_bounces
                if hit.is_hit and (is_implicit or k == 0):
                    radiance += weight * self.emitted(hit)
                if goes_on:
                    material = self.scene_data.material_library.materials[hit.material_id]
                    w_o = -direction
                    origin = offset_origin(hit.position, hit.position_error, hit.normal)
                    if ti.static(not is_implicit):
                        radiance += weight * self.sample_light(hit, origin, w_o)
                    direction = tt.BRDF.sample_direction(material, w_o, hit.normal)
                    weight *= tt.BRDF.evaluate_brdf_factor(material, w_o, direction, hit.normal)
                    if k >= self.rr_start_bounce:
                        weight = self.play_roulette(weight, self.rr_termination_probability)
        return radiance
"""
A4_THREE = """
A4Renderer.next_throughput
        inverse = 1.0 / pdf
        return throughput * inverse * f_r * cosine
A4Renderer.play_roulette
        xi = ti.random()
        goes_on = ti.floor(xi + 1 - q)  # 1 with the probability 1 - q
        return throughput * goes_on / (1 - q)
A4Renderer.sample_light
        light = tm.vec3(0)
        w_i, lamp = self.scene_data.lamps.choice.sample_mesh_lights(x)
        other = self.scene_data.ray_intersector.query_ray(tt.Ray(x, w_i))
        if other.is_hit:
            if other.triangle_id == lamp:
                to_lamp = other.position - x
                r2 = tm.dot(to_lamp, to_lamp)
                w = to_lamp / ti.sqrt(r2)
                cosines = ti.max(0, tm.dot(hit.normal, w)) * ti.max(0, -tm.dot(other.normal, w))
                material = self.scene_data.material_library.materials[hit.material_id]
                f = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
                light = self.emitted(other) * f * cosines / r2 / self.scene_data.lamps.choice.evaluate_probability()
        return light
A4Renderer.shade_ray
        radiance = tm.vec3(0)
        throughput = tm.vec3(1)
        current = ray
        hit = self.scene_data.ray_intersector.query_ray(current)
        radiance += self.emitted(hit)
        bounce = 0
        while bounce < self.max_bounces and hit.is_hit and throughput.max() > 0:
            w_o = -current.direction
            material = self.scene_data.material_library.materials[hit.material_id]
            x = offset_origin(hit.position, hit.position_error, hit.normal)
            if ti.static(self.active.name == "explicit"):
                radiance += throughput * self.sample_light(hit, x, w_o)
            w_i = tt.BRDF.sample_direction(material, w_o, hit.normal)
            pdf = tt.BRDF.evaluate_probability(material, w_o, w_i, hit.normal)
            f_r = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
            cosine = ti.max(tm.dot(hit.normal, w_i), 0.0)
            if pdf > 0 and cosine > 0:
                throughput = self.next_throughput(throughput, f_r, cosine, pdf)
            else:
                throughput = tm.vec3(0)
            bounce += 1
            if bounce > self.rr_start_bounce:
                throughput = self.play_roulette(throughput, self.rr_termination_probability)
            current = tt.Ray(origin=x, direction=w_i)
            hit = self.scene_data.ray_intersector.query_ray(current)
            if ti.static(self.active.name == "implicit"):
                radiance += throughput * self.emitted(hit)
        return radiance
"""
A4_FOUR = """
A4Renderer.next_throughput
        return ti.Matrix([[f_r.x, 0, 0], [0, f_r.y, 0], [0, 0, f_r.z]]) @ throughput * cosine / pdf
A4Renderer.play_roulette
        new_throughput = throughput
        if q > 0:
            if ti.random() <= q:
                new_throughput = tm.vec3(0)
            else:
                new_throughput *= 1 / (1 - q)
        return new_throughput
A4Renderer.sample_light
        return self.visible_light(hit, hit.position + 1e-4 * hit.normal, w_o) / self.pdf_of_light()

    @ti.func
    def pdf_of_light(self):
        return self.scene_data.lamps.choice.evaluate_probability()

    @ti.func
    def visible_light(self, hit, x, w_o):
        w_i, triangle_id = self.scene_data.lamps.choice.sample_mesh_lights(x)
        y = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
        result = tm.vec3(0)
        if y.is_hit and y.triangle_id == triangle_id:
            material = self.scene_data.material_library.materials[hit.material_id]
            f = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
            result = self.emitted(y) * f * ti.max(0.0, hit.normal.dot(w_i)) * y.normal.dot(-w_i) / y.distance**2
        return result
A4Renderer.shade_ray
        radiance = tm.vec3(0)
        throughput = tm.vec3(1)
        current = tt.Ray(origin=ray.origin, direction=ray.direction)
        is_alive = True
        for bounce in range(1 + self.max_bounces):
            hit = self.scene_data.ray_intersector.query_ray(current)
            if not is_alive or not hit.is_hit:
                is_alive = False
                continue
            if self.active.name == "implicit" or bounce == 0:
                radiance += throughput * self.emitted(hit)
            if bounce >= self.max_bounces:
                continue
            x = offset_origin(hit.position, hit.position_error, hit.normal)
            if self.active.name == "explicit":
                radiance += throughput * self.sample_light(hit, x, -current.direction)
            material = self.scene_data.material_library.materials[hit.material_id]
            w_i = tt.BRDF.sample_direction(material, -current.direction, hit.normal)
            pdf = tt.BRDF.evaluate_probability(material, -current.direction, w_i, hit.normal)
            f_r = tt.BRDF.evaluate_brdf(material, -current.direction, w_i, hit.normal)
            throughput = self.next_throughput(throughput, f_r, ti.max(0.0, tm.dot(hit.normal, w_i)), pdf + 1e-12)
            if bounce + 1 > self.rr_start_bounce:
                throughput = self.play_roulette(throughput, self.rr_termination_probability)
            if throughput.norm() == 0:
                is_alive = False
            current = tt.Ray(origin=x, direction=w_i)
        return radiance
"""
A4_FIVE = """
A4Renderer.next_throughput
        weight = f_r * cosine
        weight /= pdf
        return weight * throughput
A4Renderer.play_roulette
        new_throughput = tm.vec3(0.0)
        xi = ti.random()
        if xi > q or q == 0.0:
            new_throughput = throughput * (1.0 / (1.0 - q))
        return new_throughput
A4Renderer.sample_light
        light = tm.vec3(0)
        w_i, triangle_id = self.scene_data.lamps.choice.sample_mesh_lights(x)
        v0, v1, v2 = self.scene_data.geometry.triangle(triangle_id)
        n_y = tm.normalize(tm.cross(v1 - v0, v2 - v0))
        t = tm.dot(v0 - x, n_y) / tm.dot(w_i, n_y)
        cos_y = -tm.dot(n_y, w_i)
        if cos_y > 0:
            y = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=w_i))
            if y.is_hit and abs(y.distance - t) < 1e-3 * t:
                material = self.scene_data.material_library.materials[hit.material_id]
                f = tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal)
                G = ti.max(tm.dot(hit.normal, w_i), 0.0) * cos_y / t**2
                light = G * f * self.emitted(y) / self.scene_data.lamps.choice.evaluate_probability()
        return light
A4Renderer.shade_ray
        radiance, throughput = tm.vec3(0), tm.vec3(1)
        w_o, x = -ray.direction, ray.origin
        for bounce in range(self.max_bounces + 1):
            hit = self.scene_data.ray_intersector.query_ray(tt.Ray(origin=x, direction=-w_o))
            if not hit.is_hit:
                break
            counts = 1.0
            if ti.static(self.active.name == "explicit"):
                counts = ti.select(bounce == 0, 1.0, 0.0)
            radiance += counts * throughput * self.emitted(hit)
            if bounce == self.max_bounces:
                break
            material = self.scene_data.material_library.materials[hit.material_id]
            x = hit.position + 1e-5 * hit.normal
            if ti.static(self.active.name == "explicit"):
                radiance += self.sample_light(hit, x, w_o) * throughput
            w_i = tt.BRDF.sample_direction(material, w_o, hit.normal)
            cosine = tm.dot(hit.normal, w_i)
            if cosine <= 0:
                break
            throughput = self.next_throughput(
                throughput,
                tt.BRDF.evaluate_brdf(material, w_o, w_i, hit.normal),
                cosine,
                tt.BRDF.evaluate_probability(material, w_o, w_i, hit.normal),
            )
            if bounce >= self.rr_start_bounce:
                throughput = self.play_roulette(throughput, self.rr_termination_probability)
            if throughput.max() == 0.0:
                break
            w_o = -w_i
        return radiance
"""
RT3_ONE = """
PerspectiveCamera.compute_matrix
        forward = np.array(self.at) - np.array(self.eye)
        forward = forward / np.sqrt((forward**2).sum())
        right = np.cross(np.array(self.up), forward)
        right = right / np.sqrt((right**2).sum())
        up = np.cross(forward, right)
        return np.array([[*column, 0.0] for column in (right, up, forward)] + [[*self.eye, 1.0]]).T
PerspectiveCamera.pixel_to_screen
        l, r, b, t = self.edges()
        s = (i + 0.5) / self.width
        q = (j + 0.5) / self.height
        return tm.vec2((1.0 - s) * l + s * r, (1.0 - q) * b + q * t)
PerspectiveCamera.generate_ray
        p = self.pixel_to_screen(i, j)
        e, u, v, w = self.frame()
        direction = p.x * u + p.y * v + w
        return tt.Ray(origin=e, direction=direction / direction.norm())
OrthographicCamera.generate_ray
        l, r, b, t = self.edges()
        e, u, v, w = self.frame()
        p = tm.mix(tm.vec2(l, b), tm.vec2(r, t), tm.vec2((i + 0.5) / self.width, (j + 0.5) / self.height))
        return tt.Ray(origin=e + p.x * u + p.y * v, direction=w)
"""
RT3_TWO = """
PerspectiveCamera.compute_matrix
        w = (self.at - self.eye) / np.linalg.norm(self.at - self.eye)
        v = self.up - np.dot(self.up, w) * w
        v /= np.linalg.norm(v)
        u = np.cross(v, w)
        matrix = np.zeros((4, 4))
        matrix[:3] = np.column_stack([u, v, w, self.eye])
        matrix[3, 3] = 1
        return matrix
PerspectiveCamera.pixel_to_screen
        left, right, bottom, top = self.edges()
        pixel_width = (right - left) / self.width
        pixel_height = (top - bottom) / self.height
        return tm.vec2(left + pixel_width / 2 + i * pixel_width, bottom + pixel_height / 2 + j * pixel_height)
PerspectiveCamera.generate_ray
        screen = self.pixel_to_screen(i, j)
        m = self.camera_to_world[None]
        target = m @ tm.vec4(screen.x, screen.y, 1.0, 1.0)
        eye = m @ tm.vec4(0.0, 0.0, 0.0, 1.0)
        return tt.Ray(origin=eye.xyz, direction=tm.normalize(target.xyz - eye.xyz))
OrthographicCamera.generate_ray
        l, r, b, t = self.edges()
        x = l + (r - l) / self.width * (i + 0.5)
        y = b + (t - b) / self.height * (j + 0.5)
        m = self.camera_to_world[None]
        return tt.Ray(origin=(m @ tm.vec4(x, y, 0, 1)).xyz, direction=(m @ tm.vec4(0, 0, 1, 0)).xyz)
"""
RT3_THREE = """
PerspectiveCamera.compute_matrix
        def normalised(vector):
            return vector / np.linalg.norm(vector)

        w = normalised(self.at - self.eye)
        u = normalised(np.cross(normalised(self.up), w))
        rotation = np.array([u, np.cross(w, u), w]).T
        return np.block([[rotation, np.array(self.eye).reshape(3, 1)], [np.zeros((1, 3)), np.ones((1, 1))]])
PerspectiveCamera.pixel_to_screen
        edges = self.edges()
        x = (2 * i + 1) * (edges[1] - edges[0]) / (2 * self.width) + edges[0]
        y = (2 * j + 1) * (edges[3] - edges[2]) / (2 * self.height) + edges[2]
        return tm.vec2(x, y)
PerspectiveCamera.generate_ray
        ray = tt.Ray(origin=tm.vec3(0), direction=tm.vec3(0))
        uv = self.pixel_to_screen(i, j)
        e, u, v, w = self.frame()
        d = ti.Matrix.cols([u, v, w]) @ tm.vec3(uv, 1)
        ray.origin = e
        ray.direction = d * (1 / ti.sqrt(1 + uv.x**2 + uv.y**2))
        return ray
OrthographicCamera.generate_ray
        ray = tt.Ray(origin=tm.vec3(0), direction=tm.vec3(0))
        half, centre = self.half_size[None], self.centre[None]
        ndc = tm.vec2(2 * (i + 0.5) / self.width - 1, 2 * (j + 0.5) / self.height - 1)
        p = centre + half * ndc
        e, u, v, w = self.frame()
        for k in ti.static(range(3)):
            ray.origin[k] = e[k] + p.x * u[k] + p.y * v[k]
            ray.direction[k] = w[k]
        return ray
"""
RT3_FOUR = """
PerspectiveCamera.compute_matrix
        eye, at, up = (np.array(vector, dtype=np.float32) for vector in (self.eye, self.at, self.up))
        w = (at - eye) / np.linalg.norm(at - eye)
        u = np.cross(up, w)
        u /= np.linalg.norm(u)
        v = np.cross(w, u)
        m = np.identity(4, dtype=np.float32)
        for row in range(3):
            m[row, 0], m[row, 1], m[row, 2], m[row, 3] = u[row], v[row], w[row], eye[row]
        return m
PerspectiveCamera.pixel_to_screen
        half, centre = self.half_size[None], self.centre[None]
        size = tm.vec2(self.width, self.height)
        return centre + half * ((2 * tm.vec2(i, j) + 1) / size - 1)
PerspectiveCamera.generate_ray
        e, u, v, w = self.frame()
        l, r, b, t = self.edges()
        x = l + (r - l) * (i + 0.5) / self.width
        y = b + (t - b) * (j + 0.5) / self.height
        point = e + w + x * u + y * v
        return tt.Ray(e, (point - e).normalized())
OrthographicCamera.generate_ray
        corner, across, upwards, w = self.window()
        origin = corner + (i + 0.5) * across + (j + 0.5) * upwards
        return tt.Ray(origin=origin, direction=w)

    @ti.func
    def window(self):
        l, r, b, t = self.edges()
        e, u, v, w = self.frame()
        return e + l * u + b * v, (r - l) / self.width * u, (t - b) / self.height * v, w
"""
RT3_FIVE = """
PerspectiveCamera.compute_matrix
        gaze = self.at - self.eye
        u = np.cross(self.up, gaze)
        v = np.cross(gaze, u)
        matrix = np.eye(4)
        for column, axis in enumerate((u, v, gaze)):
            matrix[:3, column] = axis / np.linalg.norm(axis)
        matrix[:3, 3] = self.eye
        return matrix
PerspectiveCamera.pixel_to_screen
        l, r, b, t = self.edges()
        return tm.vec2(self.along(l, r, i, self.width), self.along(b, t, j, self.height))

    @ti.func
    def along(self, low, high, index, count):
        return (low * (count - index - 0.5) + high * (index + 0.5)) / count
PerspectiveCamera.generate_ray
        e, u, v, w = self.frame()
        uv = self.pixel_to_screen(i, j)
        d = tm.vec3(0.0, 0.0, 0.0)
        d.x = w.x + uv.x * u.x + uv.y * v.x
        d.y = w.y + uv.x * u.y + uv.y * v.y
        d.z = w.z + uv.x * u.z + uv.y * v.z
        return tt.Ray(origin=e, direction=tm.normalize(d))
OrthographicCamera.generate_ray
        l, r, b, t = self.edges()
        u_share, v_share = (i + 0.5) / self.width, (j + 0.5) / self.height
        e, u, v, w = self.frame()
        x = (1 - u_share) * l + u_share * r
        y = (1 - v_share) * b + v_share * t
        return tt.Ray(origin=e + ti.Matrix.cols([u, v]) @ tm.vec2(x, y), direction=w / w.norm())
"""

STUDENTS = ("one", "two", "three", "four", "five")
TEXTS = {
    "a1": (A1_ONE, A1_TWO, A1_THREE, A1_FOUR, A1_FIVE),
    "a2": (A2_ONE, A2_TWO, A2_THREE, A2_FOUR, A2_FIVE),
    "a3": (A3_ONE, A3_TWO, A3_THREE, A3_FOUR, A3_FIVE),
    "a4": (A4_ONE, A4_TWO, A4_THREE, A4_FOUR, A4_FIVE),
    "rt3": (RT3_ONE, RT3_TWO, RT3_THREE, RT3_FOUR, RT3_FIVE),
}
VARIANTS = {
    name: {student: methods(text) for student, text in zip(STUDENTS, texts, strict=True)}
    for name, texts in TEXTS.items()
}
