"""The known mistakes of assignment 4: each is a small change of the solution."""

NEXT = "throughput * f_r * cosine / pdf"

MISTAKES = {
    "A4Renderer.next_throughput": {
        "cosine forgotten": ("Which cosine stands in the rendering equation?", (NEXT, "throughput * f_r / pdf")),
        "density forgotten": (
            "What stands below the line of a Monte Carlo estimator?",
            (NEXT, "throughput * f_r * cosine"),
        ),
        "older bounces forgotten": ("What has happened to the light before?", (NEXT, "f_r * cosine / pdf")),
        "multiplied by the density": (
            "What stands below the line of a Monte Carlo estimator?",
            (NEXT, "throughput * f_r * cosine * pdf"),
        ),
        "f_r forgotten": ("How much does the surface reflect?", (NEXT, "throughput * cosine / pdf")),
    },
    "A4Renderer.play_roulette": {
        "weight missing": ("Does the mean stay the same?", ("throughput / (1 - q)", "throughput")),
        "divided by q": (
            "With which probability does the path go on?",
            ("throughput / (1 - q)", "throughput / ti.max(q, 1e-3)"),
        ),
        "goes on with the probability q": ("Which of the two is q?", ("ti.random() >= q", "ti.random() < q")),
        "never ends": ("Does a random number decide?", ("ti.random() >= q", "ti.random() >= -1")),
        "multiplied by 1 - q": (
            "Does the mean stay the same?",
            ("throughput / (1 - q)", "throughput * (1 - q)"),
        ),
    },
    "A4Renderer.sample_light": {
        "cosine at the light forgotten": (
            "How large does a light look that is seen from the side?",
            (" * cos_light / (p_area", " / (p_area"),
        ),
        "cosine at the surface forgotten": (
            "How much light falls on a surface at a grazing angle?",
            (" * cos_surface * cos_light", " * cos_light"),
        ),
        "distance not squared": (
            "How does light fade with the distance?",
            ("light_hit.distance**2", "light_hit.distance"),
        ),
        "distance forgotten": (
            "How does light fade with the distance?",
            ("(p_area * light_hit.distance**2)", "p_area"),
        ),
        "density forgotten": (
            "What is the density of the chosen point?",
            ("(p_area * light_hit.distance**2)", "light_hit.distance**2"),
        ),
        "f_r forgotten": ("How much does the surface reflect?", (" * f_r * cos_surface", " * cos_surface")),
        "cosine at the light with the wrong sign": (
            "Which way does the normal of the light point?",
            ("tm.dot(light_hit.normal, -w_i)", "tm.dot(light_hit.normal, w_i)"),
        ),
        "the chosen triangle not compared": (
            "Which lamp does the density belong to, if another one stands before it?",
            ("light_hit.is_hit and light_hit.triangle_id == triangle_id", "light_hit.is_hit and triangle_id >= 0"),
        ),
    },
    "A4Renderer.shade_ray": {
        "emission counted by both": (
            "Which light does next-event estimation find already?",
            (
                "elif bounce == 0:\n                        radiance += self.scene_data.lamps.emitted(hit)",
                "else:\n                        radiance += throughput * self.scene_data.lamps.emitted(hit)",
            ),
        ),
        "emission of the lamp itself forgotten": (
            "What colour has the lamp in the picture?",
            ("elif bounce == 0:", "elif bounce < 0:"),
        ),
        "max_bounces off by one": (
            "What is seen with 0 bounces?",
            ("range(self.max_bounces + 1)", "range(self.max_bounces)"),
        ),
        "one bounce too many": (
            "What is seen with 0 bounces?",
            ("range(self.max_bounces + 1)", "range(self.max_bounces + 2)"),
            ("if bounce < self.max_bounces:", "if bounce < self.max_bounces + 1:"),
        ),
        "throughput forgotten at emission": (
            "What has happened to the light on its way?",
            (
                "radiance += throughput * self.scene_data.lamps.emitted(hit)",
                "radiance += self.scene_data.lamps.emitted(hit)",
            ),
        ),
        "throughput forgotten at the sample of the light": (
            "What has happened to the light on its way?",
            ("radiance += throughput * self.sample_light", "radiance += self.sample_light"),
        ),
        "w_o of the eye ray at every bounce": (
            "Where does the light of a later bounce go?",
            ("w_o = -current.direction", "w_o = -ray.direction"),
        ),
        "roulette never played": ("When does the path end?", ("if bounce + 1 > self.rr_start_bounce:", "if False:")),
    },
}
