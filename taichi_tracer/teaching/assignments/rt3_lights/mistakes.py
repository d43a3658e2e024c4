"""The known mistakes of RT3's light: each is a small change of the solution."""

FALL = "(k.x + k.y * r + k.z * r**2)"
BETWEEN = "(self.cutoff - theta) / (self.cutoff - self.falloff)"
AXIS = "tm.vec3(self.target) - tm.vec3(self.position)"
THETA = "tm.degrees(tm.acos(cosine))"
HALF = "tm.normalize(surface.w_o + l)"
POWER = "ti.pow(cosine, surface.material.Ns)"
COSINE = "tm.dot(surface.normal, h)"

MISTAKES = {
    "PointLight.sample": {
        "direction from the light to the surface": (
            "From where does ω_i start, and where does it point?",
            ("w_i = to_light / r", "w_i = -to_light / r"),
        ),
        "direction not normalised": ("How long should the direction be?", ("w_i = to_light / r", "w_i = to_light")),
        "direction to the light seen from the origin": (
            "Where is the surface?",
            ("w_i = to_light / r", "w_i = tm.normalize(tm.vec3(self.position))"),
        ),
        "attenuation without square": ("Which power of r belongs to Kq?", (FALL, "(k.x + k.y * r + k.z * r)")),
        "attenuation forgotten": ("Is a lamp equally bright at all distances?", (f" / {FALL}", "")),
        "always 1/r²": ("What do Kc, Kl and Kq say?", (FALL, "r**2")),
        "Kc and Kq exchanged": ("In which order are the three numbers?", (FALL, "(k.z + k.y * r + k.x * r**2)")),
        "light divided by 4π": (
            "Is I the light in a direction, or the light in all directions together?",
            (FALL, f"{FALL} / (4 * tm.pi)"),
        ),
    },
    "DirectionalLight.sample": {
        "direction of the light instead of the direction to it": (
            "In which direction do you see the sun, if its light goes down?",
            ("-tm.normalize", "tm.normalize"),
        ),
        "direction not normalised": (
            "How long should the direction be?",
            ("-tm.normalize(tm.vec3(self.direction))", "-tm.vec3(self.direction)"),
        ),
        "direction taken as a position": (
            "Does the direction to the sun depend on where you stand?",
            ("-tm.normalize(tm.vec3(self.direction))", "tm.normalize(-tm.vec3(self.direction) - x)"),
        ),
        "light that is near": (
            "How far must a shadow ray look for something that blocks the sun?",
            ("distance = tm.inf", "distance = tm.vec3(self.direction).norm()"),
        ),
        "distance 1": (
            "How far must a shadow ray look for something that blocks the sun?",
            ("distance = tm.inf", "distance = 1.0"),
        ),
        "light that falls off": (
            "Is the sun weaker farther away from the origin?",
            ("tm.vec3(self.irradiance)", "tm.vec3(self.irradiance) / tm.dot(x, x)"),
        ),
    },
    "SpotLight.share": {
        "no cutoff": ("What is the share beyond the cutoff?", ("theta < self.cutoff", "theta >= 0")),
        "not full within the falloff": (
            "What is the share on the axis?",
            ("if theta <= self.falloff", "if theta < 0"),
        ),
        "cosine of half angle: half of the cutoff": (
            "Is the cutoff measured from the axis, or from edge to edge?",
            ("if theta <=", "if 2 * theta <="),
            ("elif theta <", "elif 2 * theta <"),
            ("(self.cutoff - theta)", "(self.cutoff - 2 * theta)"),
        ),
        "sharp edge at the cutoff": ("What is between the two angles?", (BETWEEN, "1.0")),
        "sharp edge at the falloff": ("What is between the two angles?", (BETWEEN, "0.0")),
        "grows towards the edge": (
            "Where is the share 1, and where is it 0?",
            (BETWEEN, "(theta - self.falloff) / (self.cutoff - self.falloff)"),
        ),
        "linear from the axis on": (
            "Where does the light begin to fall off?",
            (BETWEEN, "(self.cutoff - theta) / self.cutoff"),
        ),
        "linear in the cosine": (
            "Is the share linear in the angle, or in its cosine?",
            (
                BETWEEN,
                "(ti.cos(tm.radians(theta)) - ti.cos(tm.radians(self.cutoff))) "
                "/ (ti.cos(tm.radians(self.falloff)) - ti.cos(tm.radians(self.cutoff)))",
            ),
        ),
    },
    "SpotLight.sample": {
        "angle in radians": ("What does share expect: degrees or radians?", (THETA, "tm.acos(cosine)")),
        "cosine instead of the angle": ("What does share expect?", (THETA, "cosine")),
        "angle at the surface": (
            "In which direction does the light go?",
            ("tm.dot(axis, -w_i)", "tm.dot(axis, w_i)"),
        ),
        "target taken as the axis": (
            "Is the target a point or a direction?",
            (AXIS, "tm.vec3(self.target)"),
        ),
        "axis not normalised": ("When is a dot product a cosine?", (f"tm.normalize({AXIS})", f"({AXIS})")),
        "shines in all directions": (
            "What makes the difference between a spot and a point?",
            ("self.share(theta) * ", "(1 + 0 * theta) * "),
        ),
        "attenuation forgotten": ("Is a spot equally bright at all distances?", (f" / {FALL}", "")),
        "attenuation without square": ("Which power of r belongs to Kq?", (FALL, "(k.x + k.y * r + k.z * r)")),
    },
    "AmbientLight.reflected": {
        "diffuse colour instead of the ambient one": ("Which colour is k_a?", ("material.Ka", "material.Kd")),
        "intensity forgotten": (
            "How strong is the light?",
            ("tm.vec3(self.intensity) * material.Ka", "tm.vec3(1) * material.Ka"),
        ),
        "material forgotten": ("Do all surfaces show the same?", (" * material.Ka", "")),
        "sum instead of product": ("What is I_a k_a of a black surface?", (" * material.Ka", " + material.Ka")),
        "divided by π": ("Is the sum of Blinn and Phong divided by π?", ("material.Ka", "material.Ka / tm.pi")),
        "only one channel of the light": (
            "Is the light white?",
            ("tm.vec3(self.intensity)", "tm.vec3(self.intensity).x"),
        ),
    },
    "BlinnPhong.highlight": {
        "half vector not normalised": ("How long is the sum of two directions?", (HALF, "surface.w_o + l")),
        "mean instead of the normalised sum": (
            "Is the mean of two directions as long as they are?",
            (HALF, "(surface.w_o + l) / 2"),
        ),
        "reflection vector instead of half vector": (
            "What is the difference between Blinn's highlight and Phong's?",
            (COSINE, "tm.dot(tm.reflect(-l, surface.normal), surface.w_o) + 0 * h.x"),
        ),
        "absolute value of the cosine": ("Can the cosine be negative?", (f"ti.max(0.0, {COSINE})", f"abs({COSINE})")),
        "power of a negative number": ("Can the cosine be negative?", (f"ti.max(0.0, {COSINE})", COSINE)),
        "exponent forgotten": ("How narrow is the highlight?", (POWER, "cosine")),
        "normal of the triangle": (
            "Which normal varies over the surface?",
            (COSINE, "tm.dot(surface.geometric_normal, h)"),
        ),
        "multiplied by n·l": (
            "Which terms of the sum have the factor n·l?",
            (POWER, f"{POWER} * ti.max(0.0, tm.dot(surface.normal, l))"),
        ),
    },
    "BlinnPhong.shade": {
        "ambient light forgotten": (
            "What does a surface show that no light reaches?",
            ("L = scene.lights.reflected_ambient(material)", "L = tm.vec3(0)"),
        ),
        "ambient once per light": (
            "How often is the ambient term in the sum?",
            ("L += I * (diffuse + glossy)", "L += I * (diffuse + glossy) + scene.lights.reflected_ambient(material)"),
        ),
        "no shadows": (
            "What may lie between the surface and the light?",
            (" and not scene.is_blocked(surface, l, distance)", ""),
        ),
        "shadow ray towards infinity": (
            "Can something behind the light cast a shadow?",
            ("scene.is_blocked(surface, l, distance)", "scene.is_blocked(surface, l, tm.inf)"),
        ),
        "light from behind": (
            "Does a light behind the triangle reach it?",
            ("tm.dot(surface.geometric_normal, l) > 0 and ", ""),
        ),
        "cosine not clamped": ("Can a light take light away?", ("ti.max(0.0, tm.dot(n, l))", "tm.dot(n, l)")),
        "cosine forgotten": (
            "Is a surface as bright under a slanting light?",
            ("material.Kd * ti.max(0.0, tm.dot(n, l))", "material.Kd"),
        ),
        "highlight multiplied by n·l": (
            "Which terms of the sum have the factor n·l?",
            (
                "material.Ks * self.highlight(surface, l)",
                "material.Ks * self.highlight(surface, l) * ti.max(0.0, tm.dot(n, l))",
            ),
        ),
    },
    "BlinnPhong.radiance": {
        "eye ray that hits nothing is black": (
            "What does an eye ray show that hits nothing?",
            ("L = scene.behind(ray, hit, rng)", "L = tm.vec3(0)"),
        ),
        "backs shaded": ("What do the backs of surfaces show?", ("hit.is_hit and not hit.is_backfacing", "hit.is_hit")),
        "one mirror too many": (
            "How many mirrored rays are followed if depth is 1?",
            ("mirrors == self.depth", "mirrors == self.depth + 1"),
        ),
        "one mirror too few": (
            "How many mirrored rays are followed if depth is 1?",
            ("mirrors == self.depth", "mirrors == self.depth - 1"),
        ),
        "k_m of the last mirror alone": (
            "How much of the light remains after two mirrors?",
            ("k *= surface.material.Km", "k = surface.material.Km"),
        ),
        "k_m forgotten": ("How much of the light does a mirror reflect?", ("k *= surface.material.Km", "k *= 1.0")),
        "Ks instead of Km": ("Which colour does the mirror have?", ("surface.material.Km", "surface.material.Ks")),
        "the first surface multiplied by its own k_m": (
            "Which light does k_m stand before?",
            (
                "L += k * self.shade(scene, surface)\n            k *= surface.material.Km",
                "k *= surface.material.Km\n            L += k * self.shade(scene, surface)",
            ),
        ),
    },
}
