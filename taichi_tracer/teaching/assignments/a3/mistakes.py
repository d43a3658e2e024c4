"""The known mistakes of assignment 3: each is a small change of the solution."""

Y = "b0 * v0 + b1 * v1 + (1 - b0 - b1) * v2"

MISTAKES = {
    "MeshLightSampler.compute_triangle_area": {
        "half forgotten": ("What is the area of the parallelogram?", (".norm() / 2", ".norm()")),
        "cross product of the corners": ("Which two vectors span the triangle?", ("v1 - v0, v2 - v0", "v0, v1")),
        "dot product in place of the cross product": (
            "Which product is 0 for parallel edges?",
            ("tm.cross(v1 - v0, v2 - v0).norm()", "abs(tm.dot(v1 - v0, v2 - v0))"),
        ),
    },
    "MeshLightSampler.compute_cdf": {
        "not normalised": ("Which number must the last entry have?", (" / self.total_area", "")),
        "index off by one": (
            "Does the first entry contain the first triangle?",
            (
                "total += self.areas[i]\n            self.cdf[i] = total / self.total_area",
                "self.cdf[i] = total / self.total_area\n            total += self.areas[i]",
            ),
        ),
        "density instead of its sum": (
            "What does cumulative mean?",
            ("total += self.areas[i]", "total = self.areas[i]"),
        ),
        "all triangles equally probable": (
            "Should large triangles be chosen more often?",
            ("self.cdf[i] = total / self.total_area", "self.cdf[i] = (i + 1) / self.n_emissive_triangles"),
        ),
    },
    "MeshLightSampler.sample_emissive_triangle": {
        "uniform choice": (
            "Should large triangles be chosen more often?",
            ("i = low", "i = int(xi * self.n_emissive_triangles)"),
        ),
        "always the first": ("How does ξ decide?", ("i = low", "i = 0")),
        "comparison the wrong way round": (
            "In which half lies ξ if it is smaller?",
            ("if xi < self.cdf[middle]", "if xi > self.cdf[middle]"),
        ),
        "one index too low": ("Between which two entries lies ξ?", ("i = low", "i = ti.max(low - 1, 0)")),
        "the last triangle is never chosen": (
            "What is the largest index?",
            ("self.n_emissive_triangles - 1", "self.n_emissive_triangles - 2"),
        ),
        "one index too far": (
            "Between which two entries lies ξ?",
            ("i = low", "i = ti.min(low + 1, self.n_emissive_triangles - 1)"),
        ),
    },
    "MeshLightSampler.evaluate_probability": {
        "total area instead of 1/total area": (
            "What is the integral of a density?",
            ("1 / self.total_area", "self.total_area"),
        ),
        "1/number of triangles": (
            "Over what is the point distributed?",
            ("1 / self.total_area", "1 / self.n_emissive_triangles"),
        ),
        "area of the first triangle alone": (
            "Over what is the point distributed?",
            ("1 / self.total_area", "1 / self.areas[0]"),
        ),
    },
    "MeshLightSampler.sample_mesh_lights": {
        "not normalised": ("How long must a direction be?", ("tm.normalize(y - hit_point)", "y - hit_point")),
        "direction from the light to the point": ("Where does w_i point?", ("y - hit_point", "hit_point - y")),
        "hit_point forgotten": (
            "Is the direction a point or a difference?",
            ("tm.normalize(y - hit_point)", "tm.normalize(y)"),
        ),
        "always the middle of the triangle": (
            "Where on the triangle does the light come from?",
            (Y, "(v0 + v1 + v2) / 3"),
        ),
        "points gather at one corner": (
            "Is the mean of all points the middle of the triangle?",
            (Y, "(1 - xi0) * v0 + xi0 * ((1 - xi1) * v1 + xi1 * v2)"),
        ),
        "points of the parallelogram": (
            "Which shape is spanned by two independent numbers?",
            (Y, "v0 + xi0 * (v1 - v0) + xi1 * (v2 - v0)"),
        ),
        "index instead of the id of the triangle": (
            "What does sample_emissive_triangle return?",
            ("self.emissive_triangle_ids[self.sample_emissive_triangle()]", "self.sample_emissive_triangle()"),
        ),
    },
    "A3Renderer.to_solid_angle": {
        "inverted": (
            "Does a light look larger from far away?",
            ("pdf_area * distance**2 / cos_light", "pdf_area * cos_light / distance**2"),
        ),
        "distance not squared": (
            "How does the solid angle of a light shrink with the distance?",
            ("distance**2", "distance"),
        ),
        "cosine forgotten": ("How large does a light look that is seen from the side?", (" / cos_light", "")),
        "cosine multiplied": (
            "How large does a light look that is seen from the side?",
            ("/ cos_light", "* cos_light"),
        ),
        "not converted": ("Which measure does each density have?", ("pdf_area * distance**2 / cos_light", "pdf_area")),
        "distance to the third power": (
            "How does the solid angle of a light shrink with the distance?",
            ("distance**2", "distance**3"),
        ),
    },
    "A3Renderer.power_heuristic": {
        "balance heuristic instead of power": (
            "Which power does the power heuristic have?",
            ("pdf**2 / (pdf**2 + other_pdf**2)", "pdf / (pdf + other_pdf)"),
        ),
        "weight of the other strategy": (
            "Whose density stands above the line?",
            ("weight = pdf**2 /", "weight = other_pdf**2 /"),
        ),
        "square of the sum": (
            "Do the weights of both strategies sum to 1?",
            ("(pdf**2 + other_pdf**2)", "(pdf + other_pdf)**2"),
        ),
        "one half": (
            "Do both strategies find this direction equally often?",
            ("pdf**2 / (pdf**2 + other_pdf**2)", "0.5"),
        ),
    },
    "A3Renderer.shade_ray": {
        "emission forgotten": (
            "What colour has the lamp itself?",
            ("radiance = self.scene_data.lamps.emitted(hit)", "radiance = tm.vec3(0)"),
        ),
        "emission counted twice": (
            "How often is the lamp itself counted?",
            ("radiance = self.scene_data.lamps.emitted(hit)", "radiance = 2 * self.scene_data.lamps.emitted(hit)"),
        ),
        "density per area not converted": (
            "Which measure does each density have?",
            (
                "self.to_solid_angle(lights.evaluate_probability(), light_hit.distance, cos_light)",
                "lights.evaluate_probability()",
            ),
        ),
        "cosine at the surface forgotten": (
            "How much light falls on a surface at a grazing angle?",
            (" * ti.max(0.0, tm.dot(n, w_i))", ""),
        ),
        "weights of MIS forgotten": (
            "Is light that both strategies find counted twice?",
            (" * self.power_heuristic(p_light, p_brdf)", ""),
            (" * self.power_heuristic(p_brdf, p_light)", ""),
        ),
        "densities exchanged in the weights": (
            "Whose density comes first?",
            ("self.power_heuristic(p_light, p_brdf)", "self.power_heuristic(p_brdf, p_light)"),
            ("p_brdf * self.power_heuristic(p_brdf, p_light)", "p_brdf * self.power_heuristic(p_light, p_brdf)"),
        ),
        "sample of the BRDF divided by the light's density": (
            "From which density was this direction drawn?",
            ("f_cos / p_brdf", "f_cos / p_light"),
        ),
        "cosine at the light forgotten": (
            "How large does a light look that is seen from the side?",
            ("light_hit.distance, cos_light)", "light_hit.distance, 1.0 + 0 * cos_light)"),
        ),
    },
    "EnvironmentSampler.compute_probabilities": {
        "sin θ forgotten": (
            "Are texels near the poles as large as those at the equator?",
            ("luminance * np.sin(theta)[:, None]", "luminance"),
        ),
        "cos θ instead of sin θ": ("Where are the texels smallest?", ("np.sin(theta)", "abs(np.cos(theta))")),
        "not normalised": ("What is the sum of all probabilities?", ("weights / weights.sum()", "weights")),
        "mean of the channels instead of luminance": (
            "Are all colours equally bright?",
            ("image @ np.array([0.2126, 0.7152, 0.0722])", "image.mean(axis=2)"),
        ),
        "upper edge of the row instead of its middle": (
            "Which θ has the middle of the row?",
            ("(np.arange(height) + 0.5)", "np.arange(height)"),
        ),
        "all texels equally probable": (
            "Where does the light come from?",
            ("weights / weights.sum()", "np.full(weights.shape, 1 / weights.size)"),
        ),
    },
    "EnvironmentSampler.evaluate_density": {
        "sin θ forgotten": ("How large is a texel near the pole?", (" * np.sin(theta)[:, None]", "")),
        "density per texel": (
            "Over what is the density integrated?",
            ("probabilities / solid_angle", "probabilities * height * width"),
        ),
        "2π instead of π for the rows": ("How large is the range of θ?", ("(np.pi / height)", "(2 * np.pi / height)")),
        "multiplied by the solid angle": (
            "Is a density large where texels are small?",
            ("probabilities / solid_angle", "probabilities * solid_angle"),
        ),
    },
    "Environment.precompute_scalar": {
        "sin θ forgotten": ("Are texels near the poles as large as those at the equator?", (" * ti.sin(theta)", "")),
        "cos θ instead of sin θ": ("Where are the texels smallest?", ("ti.sin(theta)", "abs(ti.cos(theta))")),
        "edge of the row instead of its middle": ("Which θ has the middle of the row?", ("(y + 0.5)", "y")),
        "2π instead of π": ("How large is the range of θ?", ("tm.pi * (y", "2 * tm.pi * (y")),
        "mean of the channels instead of luminance": (
            "Are all colours equally bright?",
            ("tm.vec3(0.2126, 0.7152, 0.0722)", "tm.vec3(1 / 3)"),
        ),
        "rows upside down": (
            "Which row of image_scalar belongs to a row of the image?",
            ("self.image_scalar[x, y] = ", "self.image_scalar[x, self.y_resolution - 1 - y] = "),
        ),
    },
    "Environment.importance_sample_envmap": {
        "cdf off by one": (
            "Between which two entries of the cdf lies ξ?",
            ("(x + f_x)", "(x - 1 + f_x)"),
            ("(y + f_y)", "(y - 1 + f_y)"),
        ),
        "rows upside down": (
            "Is y = 0 at the top or at the bottom?",
            ("(y + f_y) / self.y_resolution", "1 - (y + f_y) / self.y_resolution"),
        ),
        "columns of another row": (
            "On which row does p(φ | θ) depend?",
            ("self.cdf_p_phi_given_theta[x, y] <= xi_x", "self.cdf_p_phi_given_theta[x, 0] <= xi_x"),
            ("left = self.cdf_p_phi_given_theta[x - 1, y]", "left = self.cdf_p_phi_given_theta[x - 1, 0]"),
            ("(self.cdf_p_phi_given_theta[x, y] - left)", "(self.cdf_p_phi_given_theta[x, 0] - left)"),
        ),
        "all points of the image equally probable": (
            "Where does the light come from?",
            ("tm.vec2((x + f_x) / self.x_resolution, (y + f_y) / self.y_resolution)", "tm.vec2(xi_x, xi_y)"),
        ),
        "always the edge of the texel": (
            "Where in its texel lies the point?",
            ("(x + f_x)", "x"),
            ("(y + f_y)", "y"),
        ),
        "u and v exchanged": (
            "Which of the two numbers runs along the width?",
            (
                "tm.vec2((x + f_x) / self.x_resolution, (y + f_y) / self.y_resolution)",
                "tm.vec2((y + f_y) / self.y_resolution, (x + f_x) / self.x_resolution)",
            ),
        ),
        "one random number for the row and the texel": (
            "How many random numbers does a point of an area need?",
            ("xi_x = ti.random()", "xi_x = xi_y"),
        ),
    },
}
