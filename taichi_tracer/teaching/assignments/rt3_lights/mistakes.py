"""The known mistakes of RT3's light: each is a small change of the solution."""

FALL = "(k.x + k.y * r + k.z * r**2)"
TO_LIGHT = "tm.vec3(self.position) - x"
BETWEEN = "(self.cutoff - theta) / (self.cutoff - self.falloff)"
AXIS = "tm.vec3(self.target) - tm.vec3(self.position)"
THETA = "tm.degrees(tm.acos(cosine))"
HALF = "tm.normalize(surface.w_o + l)"
POWER = "ti.pow(cosine, surface.material.Ns)"
COSINE = "tm.dot(surface.normal, h)"
CONDITION = "tm.dot(surface.geometric_normal, l) > 0 and not scene.is_blocked(surface, l, distance)"
MIRRORED = "2 * tm.dot(n, surface.w_o) * n - surface.w_o"

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
        "multiplied by the attenuation": (
            "Does the light grow with the distance?",
            (f"/ {FALL}", f"* {FALL}"),
        ),
        "distance squared": ("In which unit is the distance?", ("r = to_light.norm()", "r = to_light.norm_sqr()")),
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
        "smooth step instead of a line": (
            "What does linear mean?",
            (BETWEEN, f"{BETWEEN}\n            s = s * s * (3 - 2 * s)"),
        ),
        "square of the line": ("What does linear mean?", (BETWEEN, f"({BETWEEN}) ** 2")),
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
        "acos outside its range": (
            "What is acos(1.0000001)?",
            ("tm.clamp(tm.dot(axis, -w_i), -1.0, 1.0)", "tm.dot(axis, -w_i)"),
        ),
        "shines in all directions": (
            "What makes the difference between a spot and a point?",
            ("self.share(theta) * ", "(1 + 0 * theta) * "),
        ),
        "attenuation forgotten": ("Is a spot equally bright at all distances?", (f" / {FALL}", "")),
        "attenuation without square": ("Which power of r belongs to Kq?", (FALL, "(k.x + k.y * r + k.z * r)")),
        "direction to the target": (
            "From where does ω_i start, and where does it point?",
            (
                "w_i = to_light / r\n        axis",
                "w_i = tm.normalize(tm.vec3(self.position) - tm.vec3(self.target))\n        axis",
            ),
        ),
        "angle divided by 2": ("Is the cutoff measured from the axis, or from edge to edge?", (THETA, f"{THETA} / 2")),
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
        "light instead of the half vector": ("Which vector is h?", (HALF, "l")),
        "viewer instead of the half vector": ("Which vector is h?", (HALF, "surface.w_o")),
        "difference instead of sum": (
            "Which vector is halfway between two others?",
            (HALF, "tm.normalize(surface.w_o - l)"),
        ),
        "absolute value of the cosine": ("Can the cosine be negative?", (f"ti.max(0.0, {COSINE})", f"abs({COSINE})")),
        "power of a negative number": ("Can the cosine be negative?", (f"ti.max(0.0, {COSINE})", COSINE)),
        "exponent forgotten": ("How narrow is the highlight?", (POWER, "cosine")),
        "multiplied by the exponent": ("Which operation belongs to g?", (POWER, "cosine * surface.material.Ns")),
        "exponent on the wrong factor": (
            "Which of the two numbers is the base?",
            (POWER, "ti.pow(surface.material.Ns, cosine)"),
        ),
        "normalised to energy": (
            "Is there a factor before the power?",
            (POWER, f"(surface.material.Ns + 2) / (2 * tm.pi) * {POWER}"),
        ),
        "normal of the triangle": (
            "Which normal varies over the surface?",
            (COSINE, "tm.dot(surface.geometric_normal, h)"),
        ),
        "multiplied by n·l": (
            "Which terms of the sum have the factor n·l?",
            (POWER, f"{POWER} * ti.max(0.0, tm.dot(surface.normal, l))"),
        ),
        "exponent of Phong, four times as large": (
            "Is the exponent changed?",
            (POWER, "ti.pow(cosine, 4 * surface.material.Ns)"),
        ),
    },
    "BlinnPhong.shade": {
        "ambient light forgotten": (
            "What does a surface show that no light reaches?",
            ("L = scene.lights.reflected_ambient(material)", "L = tm.vec3(0)"),
        ),
        "ambient multiplied by cosine": (
            "From which direction does ambient light come?",
            (
                "scene.lights.reflected_ambient(material)",
                "scene.lights.reflected_ambient(material) * ti.max(0.0, tm.dot(n, surface.w_o))",
            ),
        ),
        "ambient times Kd again": (
            "Is the colour of the surface already in the ambient term?",
            ("reflected_ambient(material)", "reflected_ambient(material) * material.Kd"),
        ),
        "ambient once per light": (
            "How often is the ambient term in the sum?",
            ("L += I * (diffuse + glossy)", "L += I * (diffuse + glossy) + scene.lights.reflected_ambient(material)"),
        ),
        "no shadows": (
            "What may lie between the surface and the light?",
            (" and not scene.is_blocked(surface, l, distance)", ""),
        ),
        "only what is in shadow": (
            "Is V 1 or 0 if something is between?",
            ("and not scene.is_blocked", "and scene.is_blocked"),
        ),
        "shadow ray towards infinity": (
            "Can something behind the light cast a shadow?",
            ("scene.is_blocked(surface, l, distance)", "scene.is_blocked(surface, l, tm.inf)"),
        ),
        "shadow ray away from the light": (
            "In which direction is the light?",
            ("scene.is_blocked(surface, l, distance)", "scene.is_blocked(surface, -l, distance)"),
        ),
        "light from behind": (
            "Does a light behind the triangle reach it?",
            ("tm.dot(surface.geometric_normal, l) > 0 and ", ""),
        ),
        "light from behind the interpolated normal instead of the triangle": (
            "Which of the two normals says what is behind the surface?",
            ("tm.dot(surface.geometric_normal, l) > 0", "tm.dot(n, l) > 0"),
        ),
        "cosine not clamped": ("Can a light take light away?", ("ti.max(0.0, tm.dot(n, l))", "tm.dot(n, l)")),
        "cosine forgotten": (
            "Is a surface as bright under a slanting light?",
            ("material.Kd * ti.max(0.0, tm.dot(n, l))", "material.Kd"),
        ),
        "cosine of the triangle's normal": (
            "Which normal varies over the surface?",
            ("tm.dot(n, l)", "tm.dot(surface.geometric_normal, l)"),
        ),
        "cosine to the viewer": (
            "Which angle does the diffuse term depend on?",
            ("tm.dot(n, l)", "tm.dot(n, surface.w_o)"),
        ),
        "highlight multiplied by n·l": (
            "Which terms of the sum have the factor n·l?",
            (
                "material.Ks * self.highlight(surface, l)",
                "material.Ks * self.highlight(surface, l) * ti.max(0.0, tm.dot(n, l))",
            ),
        ),
        "highlight without Ks": (
            "Which colour has the highlight?",
            ("material.Ks * self.highlight", "self.highlight"),
        ),
        "highlight with the diffuse colour": ("Which colour has the highlight?", ("material.Ks *", "material.Kd *")),
        "no highlight": (
            "Which terms does the sum have for each light?",
            ("(diffuse + glossy)", "diffuse + 0 * glossy"),
        ),
        "highlight in the shadow": (
            "Which terms of the sum have the factor V?",
            (f"if {CONDITION}:", f"is_lit = {CONDITION}\n            if True:"),
            ("L += I * (diffuse + glossy)", "L += I * (ti.select(is_lit, diffuse, tm.vec3(0)) + glossy)"),
        ),
        "divided by π": (
            "Is the sum of Blinn and Phong divided by π?",
            ("material.Kd * ti.max", "material.Kd / tm.pi * ti.max"),
        ),
        "only the last light": (
            "How do several lights add?",
            ("L += I *", "L = scene.lights.reflected_ambient(material) + I *"),
        ),
        "divided by the squared distance again": (
            "Is the attenuation already in I?",
            ("L += I * (diffuse + glossy)", "L += I * (diffuse + glossy) / ti.min(distance**2, 1e6)"),
        ),
        "colour of the light forgotten": ("Which colour does a red light make of white?", ("L += I * ", "L += I.x * ")),
    },
    "BlinnPhong.radiance": {
        "eye ray that hits nothing is black": (
            "What does an eye ray show that hits nothing?",
            ("L = scene.behind(ray, hit, rng)", "L = tm.vec3(0)"),
        ),
        "backs shaded": ("What do the backs of surfaces show?", ("hit.is_hit and not hit.is_backfacing", "hit.is_hit")),
        "no mirrors, or mirrored rays that enter the surface": (
            "On which side of the surface is the mirrored ray?",
            (MIRRORED, "surface.w_o - 2 * tm.dot(n, surface.w_o) * n"),
        ),
        "one mirror too many": (
            "How many mirrored rays are followed if depth is 1?",
            ("mirrors == self.depth", "mirrors == self.depth + 1"),
        ),
        "one mirror too few": (
            "How many mirrored rays are followed if depth is 1?",
            ("mirrors == self.depth", "mirrors == self.depth - 1"),
        ),
        "without end": ("What does depth say?", ("mirrors == self.depth", "mirrors == 64")),
        "always one mirror": ("May a mirrored ray meet a mirror again?", ("mirrors == self.depth", "mirrors == 1")),
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
        "light of mirrored surfaces not multiplied": (
            "Which light does k_m stand before?",
            ("L += k * self.shade", "L += self.shade"),
        ),
        "only the last surface": (
            "Does a mirror have a colour of its own?",
            ("L += k * self.shade", "L = k * self.shade"),
        ),
        "back to the viewer": ("In which direction does a mirror reflect?", (MIRRORED, "surface.w_o")),
        "straight up from the surface": ("In which direction does a mirror reflect?", (MIRRORED, "n")),
        "mirrored ray that hits nothing is black": (
            "What does a mirror show where nothing is?",
            ("L += k * scene.lights", "L += 0 * k * scene.lights"),
        ),
        "sky in a mirror not multiplied by k_m": (
            "How much of the light does a mirror reflect?",
            ("L += k * scene.lights", "L += scene.lights"),
        ),
    },
}
