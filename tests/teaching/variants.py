"""Right solutions that are written differently: bodies of methods, by assignment and part."""

A1 = {
    "one": {
        "Camera.generate_ndc_coords": """
        u = (pixel_x + 0.5) / self.width
        v = (pixel_y + 0.5) / self.height
        return tm.vec2(-1 + u + u, -1 + v + v)
""",
        "Camera.generate_camera_coords": """
        top = ti.sin(self.fov * (tm.pi / 360)) / ti.cos(self.fov * (tm.pi / 360))
        right = top * (self.width / self.height)
        return tm.vec4(right * ndc_coords.x, top * ndc_coords.y, 1.0, 0.0)
""",
        "RayIntersector.intersect_triangle": """
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
""",
    },
    "two": {
        "Camera.compute_matrix": """
        forward = np.array(self.at) - np.array(self.eye)
        forward /= np.sqrt(forward @ forward)
        right = np.cross(np.array(self.up), forward)
        right /= np.sqrt(right @ right)
        rows = np.stack([right, np.cross(forward, right), forward, np.array(self.eye)])
        return np.vstack([rows.T, [0, 0, 0, 1]])
""",
        "Camera.generate_ray": """
        p = self.generate_camera_coords(self.generate_ndc_coords(pixel_x, pixel_y))
        m = self.camera_to_world[None]
        target = m @ tm.vec4(p.xyz, 1)
        return tt.Ray(origin=self.eye, direction=(target.xyz / target.w - self.eye).normalized())
""",
        "RayIntersector.query_ray": """
        best = tt.HitData()
        closest = 1e30
        for i in range(self.geometry.n_triangles):
            candidate = self.intersect_triangle(ray, self.geometry.n_triangles - 1 - i)
            if candidate.is_hit:
                if candidate.distance < closest:
                    closest = candidate.distance
                    best = candidate
        return best
""",
        "A1Renderer.shade_hit": """
        front = tm.vec3(1, 1, 1) * hit_data.is_hit
        return ti.select(hit_data.is_backfacing, tm.vec3(0.5, 0, 0), front)
""",
        "A1Renderer.shade_normal": "        return (0.5 * hit_data.normal + 0.5) * hit_data.is_hit\n",
    },
    "three": {
        "Camera.generate_ndc_coords": """
        size = tm.vec2(self.width, self.height)
        return (2 * tm.vec2(pixel_x, pixel_y) + 1 - size) / size
""",
        "RayIntersector.intersect_triangle": """
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
""",
        "A1Renderer.shade_distance": """
        grey = ti.min(ti.max(hit_data.distance * (1 / self.max_distance), 0), 1)
        return ti.select(hit_data.is_hit, tm.vec3(grey, grey, grey), tm.vec3(0))
""",
    },
    "four": {
        "Camera.generate_camera_coords": """
        half = tm.radians(self.fov) / 2
        y = ndc_coords.y * tm.tan(half)
        x = ndc_coords.x * tm.tan(half) * self.width / self.height
        return tm.vec4(x, y, 1, 0)
""",
        "Camera.compute_matrix": """
        z = self.at - self.eye
        z = z / np.linalg.norm(z)
        y = self.up - (self.up @ z) * z
        y = y / np.linalg.norm(y)
        m = np.zeros((4, 4))
        m[:3, 1], m[:3, 2], m[:3, 0], m[:3, 3], m[3, 3] = y, z, np.cross(y, z), self.eye, 1
        return m
""",
        "RayIntersector.query_ray": """
        nearest = self.intersect_triangle(ray, 0)
        for i in range(1, self.geometry.n_triangles):
            hit = self.intersect_triangle(ray, i)
            is_nearer = hit.is_hit and (not nearest.is_hit or hit.distance < nearest.distance)
            if is_nearer:
                nearest = hit
        return nearest
""",
    },
    "five": {
        "Camera.generate_ray": """
        c = self.generate_camera_coords(self.generate_ndc_coords(pixel_x, pixel_y))
        m = self.camera_to_world[None]
        d = tm.vec3(0)
        for k in ti.static(range(3)):
            d[k] = m[k, 0] * c.x + m[k, 1] * c.y + m[k, 2] * c.z
        return tt.Ray(self.eye, d / ti.sqrt(d.x**2 + d.y**2 + d.z**2))
""",
        "RayIntersector.query_ray": """
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
""",
        "A1Renderer.shade_barycentric": """
        uv = hit_data.barycentric_coords
        return ti.select(hit_data.is_hit != 0, 1, 0) * tm.vec3(uv, 1 - uv.x - uv.y)
""",
    },
}

A2 = {
    "one": {
        "Camera.generate_ndc_coords": """
        x, y = pixel_x + 0.5, pixel_y + 0.5
        if jitter:
            y += ti.random() - 0.5
            x += ti.random() - 0.5
        return tm.vec2(2 * x / self.width - 1, 2 * y / self.height - 1)
""",
        "A2Renderer.running_mean": "        return mean + (sample - mean) / (count + 1)\n",
        "UniformSampler.sample_direction": """
        phi = 2 * tm.pi * ti.random()
        y = 1 - 2 * ti.random()
        r = ti.sqrt(ti.max(0.0, 1 - y**2))
        return tm.vec3(r * ti.sin(phi), y, r * ti.cos(phi))
""",
        "BRDF.evaluate_brdf": """
        value = material.Kd / tm.pi
        if material.Ns > 1:
            w_r = -tm.reflect(w_o, normal)
            value = (material.Ns + 1) / (2 * tm.pi) * material.Kd * ti.max(tm.dot(w_r, w_i), 0.0) ** material.Ns
        return value
""",
    },
    "two": {
        "UniformSampler.sample_direction": """
        p = tm.vec3(2)
        while p.norm() > 1 or p.norm() < 1e-3:
            p = 2 * tm.vec3(ti.random(), ti.random(), ti.random()) - 1
        return p.normalized()
""",
        "BRDF.sample_direction": """
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
""",
        "Environment.query_ray": """
        d = ray.direction.normalized()
        phi = ti.atan2(d.z, d.x) + tm.pi
        theta = ti.acos(ti.max(-1.0, ti.min(1.0, d.y)))
        i = ti.cast(phi / (2 * tm.pi) * self.width, ti.i32) % self.width
        j = ti.cast(theta / tm.pi * self.height, ti.i32)
        return self.texels[ti.min(j, self.height - 1), i]
""",
    },
    "three": {
        "BRDF.sample_direction": """
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
""",
        "A2Renderer.running_mean": "        return mean * (count / (count + 1)) + sample / (count + 1)\n",
        "A2Renderer.shade_ray": """
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
""",
    },
    "four": {
        "Camera.generate_ray": """
        c = self.generate_camera_coords(self.generate_ndc_coords(pixel_x, pixel_y, jitter))
        return tt.Ray(origin=self.eye, direction=(self.camera_to_world[None] @ c).xyz.normalized())
""",
        "BRDF.evaluate_probability": """
        pdf = tm.max(tm.dot(w_i, normal), 0.0) / tm.pi
        if material.Ns > 1:
            half = ti.max(tm.dot(2 * normal * tm.dot(w_o, normal) - w_o, w_i), 0.0)
            pdf = (1 + material.Ns) * half**material.Ns / 2 / tm.pi
        return pdf
""",
    },
    "five": {
        "BRDF.evaluate_brdf_factor": """
        cosine = ti.max(tm.dot(w_i, normal), 0.0)
        return ti.select(material.Ns > 1, material.Kd * cosine, material.Kd)
""",
        "UniformSampler.evaluate_probability": "        return 0.25 / tm.pi\n",
        "UniformSampler.sample_direction": """
        a, b, c = ti.randn(), ti.randn(), ti.randn()
        return tm.normalize(tm.vec3(a, b, c))
""",
    },
}

VARIANTS = {"a1": A1, "a2": A2}
