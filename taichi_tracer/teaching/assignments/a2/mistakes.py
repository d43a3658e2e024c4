"""The known mistakes of assignment 2: each is a small change of the solution."""

WITHIN = "tm.vec2(ti.random(), ti.random())"
NEW_MEAN = "(mean * count + sample) / (count + 1)"
W_R = "2 * tm.dot(normal, w_o) * normal - w_o"
POWER = "ti.pow(cosine, material.Ns)"

MISTAKES = {
    "Camera.generate_ndc_coords": {
        "jitter of a whole pixel to each side": (
            "How far may the point lie from the centre of the pixel?",
            (WITHIN, "tm.vec2(2 * ti.random() - 0.5, 2 * ti.random() - 0.5)"),
        ),
        "jitter added to the centre": (
            "Where does the pixel begin if ξ = 0?",
            (WITHIN, "tm.vec2(0.5 + ti.random(), 0.5 + ti.random())"),
        ),
        "jitter around the corner": (
            "Which point is the mean of all points?",
            (WITHIN, "tm.vec2(ti.random() - 0.5, ti.random() - 0.5)"),
        ),
        "one random number for both axes": (
            "How many random numbers does a point of an area need?",
            ("within = tm.vec2(ti.random(), ti.random())", "xi = ti.random()\n            within = tm.vec2(xi, xi)"),
        ),
        "jitter ignored": ("What does the parameter jitter say?", ("if jitter:", "if False:")),
        "jitter always on": ("What does the parameter jitter say?", ("if jitter:", "if True:")),
        "pixel corner without jitter": (
            "Through which point did the ray of assignment 1 pass?",
            ("within = tm.vec2(0.5)", "within = tm.vec2(0)"),
        ),
        "jitter in x only": ("Are horizontal edges smooth?", (WITHIN, "tm.vec2(ti.random(), 0.5)")),
    },
    "Camera.generate_ray": {
        "jitter not passed on": ("Who needs to know about jitter?", ("pixel_y, jitter)", "pixel_y)")),
        "direction moved instead of the point of the pixel": (
            "Where is the random point chosen?",
            ("pixel_y, jitter)", "pixel_y)"),
            (
                "ray.direction = tm.normalize(world_coords.xyz)",
                "shift = tm.vec3(ti.random() - 0.5, ti.random() - 0.5, 0) / self.width\n"
                "        ray.direction = tm.normalize(world_coords.xyz)\n"
                "        if jitter:\n"
                "            ray.direction = tm.normalize(world_coords.xyz + shift)",
            ),
        ),
    },
    "A2Renderer.running_mean": {
        "divided by one sample too many": (
            "How many samples are in the new mean?",
            (NEW_MEAN, "(mean * count + sample) / (count + 2)"),
        ),
        "divided by one sample too few": (
            "How many samples are in the new mean?",
            (NEW_MEAN, "(mean * count + sample) / ti.max(count, 1)"),
        ),
        "sum instead of mean": ("Does the picture become brighter with time?", (NEW_MEAN, "mean * count + sample")),
        "the newest sample counts half": ("Do all samples have the same weight?", (NEW_MEAN, "(mean + sample) / 2")),
        "only the newest sample": ("What happens to the older samples?", (NEW_MEAN, "sample")),
        "the old mean is not multiplied by its count": (
            "What is the sum of the first samples?",
            (NEW_MEAN, "(mean + sample) / (count + 1)"),
        ),
        "the mean of an older picture is kept": (
            "What is the mean of one sample?",
            (NEW_MEAN, "(mean * (count + 1) + sample) / (count + 2)"),
        ),
        "divided by the number of older samples, even by 0": (
            "How many samples are in the new mean?",
            (NEW_MEAN, "(mean * count + sample) / count"),
        ),
    },
    "Environment.query_ray": {
        "v divided by 2π": ("From where to where does asin run?", ("/ tm.pi\n", "/ (2 * tm.pi)\n")),
        "v upside down": ("Is the first row of the picture at the top?", ("(1 - v) * self.height", "v * self.height")),
        "u mirrored": ("In which direction does u grow?", ("0.5 + tm.atan2", "0.5 - tm.atan2")),
        "arguments of atan2 exchanged": (
            "Which argument of atan2 is the height, and which the base?",
            ("tm.atan2(d.z, d.x)", "tm.atan2(d.x, d.z)"),
        ),
        "u without the half": ("Where is u = 0?", ("u = 0.5 + tm", "u = 1 + tm")),
        "asin outside its range": ("What is asin(1.0000001)?", ("tm.clamp(d.y, -1, 1)", "d.y")),
        "index one too far": (
            "Which number does the last column have?",
            ("ti.min(int(u * self.width), self.width - 1)", "int(u * self.width) + 1"),
        ),
        "row and column exchanged": (
            "Which index of texels comes first?",
            ("self.texels[row, column]", "self.texels[ti.min(column, self.height - 1), row]"),
        ),
    },
    "UniformSampler.sample_direction": {
        "only the upper half of the sphere": ("Which numbers can ω_z have?", ("2 * ti.random() - 1", "ti.random()")),
        "only half a turn": ("How large is a full turn?", ("phi = 2 * tm.pi", "phi = tm.pi")),
        "r without the root": ("How long must the direction be?", ("ti.sqrt(1 - z * z)", "1 - z * z")),
        "angle uniform instead of its cosine": (
            "Are there as many directions near the poles as near the equator?",
            ("z = 2 * ti.random() - 1", "z = ti.cos(tm.pi * ti.random())"),
        ),
        "one random number for both angles": (
            "How many random numbers does a direction need?",
            ("z = 2 * ti.random() - 1", "xi = ti.random()\n        z = 2 * xi - 1"),
            ("2 * tm.pi * ti.random()", "2 * tm.pi * xi"),
        ),
        "a random point of a cube, normalised": (
            "Are there more directions towards the corners of a cube?",
            (
                "direction = tm.vec3(r * ti.cos(phi), r * ti.sin(phi), z)",
                "direction = tm.normalize(2 * tm.vec3(ti.random(), ti.random(), ti.random()) - 1)",
            ),
        ),
        "a quarter of a turn to each side": (
            "How large is a full turn?",
            ("2 * tm.pi * ti.random()", "tm.pi * (ti.random() - 0.5)"),
        ),
    },
    "UniformSampler.evaluate_probability": {
        "1/(2π) for the whole sphere": ("How large is the solid angle of the sphere?", ("(4 *", "(2 *")),
        "4π instead of 1/(4π)": ("What is the integral of a density?", ("1 / (4 * tm.pi)", "4 * tm.pi")),
        "1/π": ("How large is the solid angle of the sphere?", ("(4 * tm.pi)", "tm.pi")),
        "π outside the bracket": ("What does 1 / 4 * π mean in Python?", ("(4 * tm.pi)", "4 * tm.pi")),
    },
    "BRDF.sample_direction": {
        "exponent 1/α instead of 1/(α + 1)": (
            "Which exponent makes the integral of the density 1?",
            ("1 / (alpha + 1)", "1 / alpha"),
        ),
        "lobe always around the normal": ("Around which axis is a Phong lobe?", (f"axis = {W_R}", "axis = normal")),
        "lobe around the direction to the viewer": (
            "In which direction does a mirror reflect?",
            (f"axis = {W_R}", "axis = w_o"),
        ),
        "w_o reflected with the wrong sign": (
            "In which direction does w_o point?",
            (f"axis = {W_R}", f"axis = -({W_R})"),
        ),
        "direction left in the frame of the z axis": (
            "Does the lobe turn with the surface?",
            (
                "w_i = r * ti.cos(phi) * tangent + r * ti.sin(phi) * bitangent + z * axis",
                "w_i = tm.vec3(r * ti.cos(phi), r * ti.sin(phi), z) + 0 * (tangent + bitangent)",
            ),
        ),
        "frame from a fixed axis": ("Which cross product is 0 on a floor?", ("if abs(axis.x) > 0.9:", "if True:")),
        "tangent not normalised": (
            "How long is a cross product?",
            ("tm.normalize(tm.cross(other, axis))", "tm.cross(other, axis)"),
        ),
        "α of diffuse materials is 0": ("Which α gives the cosine?", ("alpha = 1.0", "alpha = 0.0")),
    },
    "BRDF.evaluate_probability": {
        "negative cosine not cut off": (
            "How probable are directions below the horizon?",
            ("ti.max(0.0, tm.dot(normal, w_i)) / tm.pi", "tm.dot(normal, w_i) / tm.pi"),
        ),
        "density of the lobe around the normal": ("Around which axis were the directions drawn?", (W_R, "normal")),
        "w_i and w_o exchanged": (
            "Which of the two directions is mirrored? For a pure lobe the result is the same; what else uses w_i?",
            ("tm.dot(normal, w_i)", "tm.dot(normal, w_o)"),
        ),
        "α instead of α + 1": ("Is the integral of the density 1?", ("(material.Ns + 1)", "material.Ns")),
        "π instead of 2π": ("Is the integral of the density 1?", ("(2 * tm.pi)", "tm.pi")),
        "diffuse density without 1/π": ("Is the integral of the density 1?", ("w_i)) / tm.pi", "w_i))")),
        "density times the cosine": (
            "Is the cosine at the surface part of the Phong density?",
            (POWER, f"{POWER} * ti.max(0.0, tm.dot(normal, w_i))"),
        ),
        "power inside max": (
            "What is a negative number to an even power?",
            ("cosine = ti.max(0.0, tm.dot(w_r, w_i))", "cosine = abs(tm.dot(w_r, w_i))"),
        ),
    },
    "BRDF.evaluate_brdf": {
        "1/π forgotten": (
            "How much light does a white surface reflect in all?",
            ("material.Kd / tm.pi", "material.Kd"),
        ),
        "Ks instead of Kd": (
            "Which colour is the reflectance of both lobes?",
            ("material.Kd * (material.Ns + 1)", "material.Ks * (material.Ns + 1)"),
        ),
        "α + 2 instead of α + 1": (
            "Which normalisation does the handout have?",
            ("(material.Ns + 1)", "(material.Ns + 2)"),
        ),
        "Phong not normalised": ("Which factor stands before the power?", (" * (material.Ns + 1) / (2 * tm.pi)", "")),
        "lobe around the normal": ("Around which axis is a Phong lobe?", (W_R, "normal")),
        "the cosine belongs to f_r twice": (
            "Does f_r contain the cosine at the surface?",
            ("brdf = material.Kd / tm.pi", "brdf = material.Kd / tm.pi * ti.max(0.0, tm.dot(normal, w_i))"),
        ),
        "negative cosine not cut off": (
            "What does the lobe reflect to the other side?",
            ("cosine = ti.max(0.0, tm.dot(w_r, w_i))", "cosine = abs(tm.dot(w_r, w_i))"),
        ),
        "2π instead of π for diffuse materials": (
            "What is the integral of the cosine over the hemisphere?",
            ("material.Kd / tm.pi", "material.Kd / (2 * tm.pi)"),
        ),
    },
    "BRDF.evaluate_brdf_factor": {
        "the cosine of Phong forgotten": (
            "Which cosine does not cancel?",
            ("material.Kd * ti.max(0.0, tm.dot(normal, w_i))", "material.Kd"),
        ),
        "cosine also for diffuse materials": (
            "Which cosine cancels for a diffuse material?",
            ("factor = material.Kd\n", "factor = material.Kd * ti.max(0.0, tm.dot(normal, w_i))\n"),
        ),
        "negative cosine not cut off": (
            "What arrives from below the horizon?",
            ("ti.max(0.0, tm.dot(normal, w_i))", "tm.dot(normal, w_i)"),
        ),
        "cosine of w_o instead of w_i": (
            "Which direction leads to the light?",
            ("tm.dot(normal, w_i)", "tm.dot(normal, w_o)"),
        ),
        "divided by π again": (
            "What is left of Kd/π · cos / (cos/π)?",
            ("factor = material.Kd\n", "factor = material.Kd / tm.pi\n"),
        ),
        "absolute value of the cosine": (
            "What arrives from below the horizon?",
            ("ti.max(0.0, tm.dot(normal, w_i))", "abs(tm.dot(normal, w_i))"),
        ),
    },
    "A2Renderer.shade_ray": {
        "environment read with the eye ray": (
            "From which direction does the reflected light come?",
            (
                "radiance = factor * self.scene_data.environment.query_ray(shadow_ray)",
                "radiance = factor * self.scene_data.environment.query_ray(ray)",
            ),
        ),
        "visibility inverted": (
            "Does the light arrive if something stands before it?",
            ("if not blocker.is_hit", "if blocker.is_hit"),
        ),
        "visibility forgotten": ("Where are the shadows?", ("if not blocker.is_hit", "if True")),
        "not divided by the density": (
            "What stands below the fraction line of a Monte Carlo estimator?",
            (" / UniformSampler.evaluate_probability()", ""),
        ),
        "cosine forgotten": (
            "How much light falls on a surface at a grazing angle?",
            ("f_r * cosine / Uni", "f_r / Uni"),
        ),
        "w_o points into the surface": ("Where does w_o point?", ("w_o = -ray.direction", "w_o = ray.direction")),
        "background missing": (
            "What does a ray see that hits nothing?",
            ("radiance = self.scene_data.environment.query_ray(ray)\n", "radiance = tm.vec3(0)\n"),
        ),
        "shadow ray starts on the surface, without offset": (
            "Does the shadow ray hit the surface that it leaves?",
            ("offset_origin(hit.position, hit.position_error, n)", "hit.position - 1e-4 * n"),
        ),
    },
    "MicrofacetBRDF.sample_direction": {
        "not stretched": ("In which space is the distribution a hemisphere?", ("tm.normalize(stretch * o)", "o")),
        "the normal is not stretched back": (
            "In which space is ω_m?",
            ("tm.normalize(stretch * (tm.vec3", "tm.normalize(1 * (tm.vec3"),
        ),
        "w_i is the normal of the tiny mirror": (
            "What does a mirror with this normal do?",
            ("2 * tm.dot(m, o) * m - o", "m"),
        ),
        "mirrored at the surface's normal": (
            "At which normal is w_o mirrored?",
            ("2 * tm.dot(m, o) * m - o", "tm.vec3(-o.x, -o.y, o.z)"),
        ),
        "one random number for both angles": (
            "How many random numbers does a direction need?",
            ("z = (1 - ti.random()) *", "xi = ti.random()\n        z = (1 - xi) *"),
            ("2 * tm.pi * ti.random()", "2 * tm.pi * xi"),
        ),
        "only half a turn": ("How large is a full turn?", ("phi = 2 * tm.pi", "phi = tm.pi")),
    },
    "MicrofacetBRDF.evaluate_probability": {
        "without 1/(4 ω_o·ω_m)": (
            "Per which solid angle is the density: of ω_m, or of ω_i?",
            ("visible / (4 * tm.dot(o, m))", "visible"),
        ),
        "1/4 forgotten": ("How fast does ω_i turn if ω_m turns?", ("(4 * tm.dot(o, m))", "tm.dot(o, m)")),
        "ω_i in place of ω_o": (
            "From where were the normals visible?",
            ("((a_x * o.x) ** 2 + (a_y * o.y) ** 2) / o.z**2", "((a_x * i.x) ** 2 + (a_y * i.y) ** 2) / i.z**2"),
            ("lambda_o) * o.z)", "lambda_o) * i.z)"),
        ),
        "D alone": (
            "Which normals are visible?",
            ("D * ti.max(0.0, tm.dot(o, m)) / ((1 + lambda_o) * o.z)", "D * m.z"),
        ),
        "t not squared": ("Which power of t does D have?", ("a_y * t * t", "a_y * t")),
        "Λ without the half": ("What is Λ if α is large?", ("- 1) / 2", "- 1)")),
    },
    "MicrofacetBRDF.evaluate_brdf": {
        "separable G": (
            "Are the shadows of both directions independent?",
            ("G = 1 / (1 + lambda_o + lambda_i)", "G = 1 / ((1 + lambda_o) * (1 + lambda_i))"),
        ),
        "t not squared": ("Which power of t does D have?", ("a_y * t * t", "a_y * t")),
        "π forgotten in D": ("What is the integral of D cos θ?", ("(tm.pi * a_x", "(a_x")),
        "Schlick with the surface's normal": (
            "At which surface is light reflected?",
            ("tm.dot(o, m)) ** 5", "o.z) ** 5"),
        ),
        "no Fresnel": (
            "Which colour has a metal at grazing angles?",
            ("+ (1 - material.F0) * (1 - tm.dot(o, m)) ** 5", "+ 0 * m.x"),
        ),
        "the cosine belongs to f_r": ("Does f_r contain the cosine at the surface?", ("(4 * i.z * o.z)", "(4 * o.z)")),
        "4 forgotten": ("How fast does ω_i turn if ω_m turns?", ("(4 * i.z * o.z)", "(i.z * o.z)")),
        "shadows forgotten": (
            "What hides a tiny mirror?",
            ("G = 1 / (1 + lambda_o + lambda_i)", "G = 1.0 + 0 * (lambda_o + lambda_i)"),
        ),
    },
    "MicrofacetBRDF.evaluate_brdf_factor": {
        "separable G": (
            "Are the shadows of both directions independent?",
            ("(1 + lambda_o) / (1 + lambda_o + lambda_i)", "1 / (1 + lambda_i)"),
        ),
        "G instead of G / G1": ("What is left of G after the division?", ("F * (1 + lambda_o) /", "F /")),
        "no Fresnel": (
            "Which colour has a metal at grazing angles?",
            ("+ (1 - material.F0) * (1 - tm.dot(o, m)) ** 5", "+ 0 * m.x"),
        ),
        "Schlick with the surface's normal": (
            "At which surface is light reflected?",
            ("tm.dot(o, m)) ** 5", "o.z) ** 5"),
        ),
        "ω_i and ω_o exchanged": (
            "By which of the two was the density divided?",
            ("F * (1 + lambda_o) /", "F * (1 + lambda_i) /"),
        ),
    },
}
