"""The known mistakes of RT3's phase 2: each is a small change of the solution."""

DIRECTION = "tm.normalize(w + point.x * u + point.y * v)"

MISTAKES = {
    "PerspectiveCamera.compute_matrix": {
        "right-handed frame": (
            "Which factor comes first in vup × w?",
            ("np.cross(self.up, w)", "np.cross(w, self.up)"),
        ),
        "v turned round": (
            "The order of the factors of a cross product matters.",
            ("np.cross(w, u)", "np.cross(u, w)"),
        ),
        "w points away from the scene": (
            "Where does a left-handed camera look?",
            ("self.at - self.eye", "self.eye - self.at"),
        ),
        "u not normalised": ("How long is a cross product?", ("u = u / np.linalg.norm(u)\n", "u = u + 0\n")),
        "w not normalised": ("How long is the gaze?", ("w = gaze / np.linalg.norm(gaze)", "w = gaze")),
        "vup taken as v": ("Is vup perpendicular to w?", ("v = np.cross(w, u)", "v = self.up")),
        "matrix transposed": (
            "Are the axes the rows or the columns?",
            ("matrix[:3, 3] = self.eye", "matrix[:3, 3] = self.eye\n        matrix = matrix.T"),
        ),
        "eye missing": ("Where do the rays start?", ("matrix[:3, 3] = self.eye", "")),
    },
    "PerspectiveCamera.pixel_to_screen": {
        "pixel corner instead of centre": (
            "Where are the integer coordinates?",
            ("(i + 0.5)", "i"),
            ("(j + 0.5)", "j"),
        ),
        "j counts from the top": ("Which row is row 0?", ("b + (t - b)", "t - (t - b)")),
        "n_x and n_y exchanged": (
            "How many columns are there?",
            ("self.width", "self.HEIGHT"),
            ("self.height", "self.width"),
            ("self.HEIGHT", "self.height"),
        ),
        "l and b forgotten": ("Where is the left edge?", ("l + (r", "(r"), ("b + (t", "(t")),
        "divided by n - 1": (
            "How many pixels is the window wide?",
            ("/ self.width", "/ (self.width - 1)"),
            ("/ self.height", "/ (self.height - 1)"),
        ),
        "window taken as [-1, 1]": (
            "What does screen_window say?",
            ("l, r, b, t = self.edges()", "l, r, b, t = -1.0, 1.0, -1.0, 1.0"),
        ),
    },
    "PerspectiveCamera.generate_ray": {
        "direction not normalised": ("How long should the direction be?", (DIRECTION, "w + point.x * u + point.y * v")),
        "w forgotten": (
            "In which direction does the window stand?",
            (DIRECTION, "tm.normalize(point.x * u + point.y * v)"),
        ),
        "origin on the window": (
            "Which point do all rays of this camera share?",
            ("ray.origin = e", "ray.origin = e + point.x * u + point.y * v"),
        ),
        "u and v exchanged": ("Which axis is horizontal?", (DIRECTION, "tm.normalize(w + point.y * u + point.x * v)")),
        "looks backwards": ("Where is the window?", (DIRECTION, "tm.normalize(-w + point.x * u + point.y * v)")),
        "eye taken as a part of the direction": (
            "Is the direction a point or a difference?",
            (DIRECTION, "tm.normalize(e + w + point.x * u + point.y * v)"),
        ),
    },
    "OrthographicCamera.generate_ray": {
        "rays from the eye": (
            "Where does each ray of this camera start?",
            ("ray.origin = e + x * u + y * v", "ray.origin = e"),
        ),
        "perspective direction": (
            "Are the rays parallel?",
            ("ray.direction = w", "ray.direction = tm.normalize(w + x * u + y * v)"),
        ),
        "pixel corner instead of centre": (
            "Where are the integer coordinates?",
            ("(i + 0.5)", "i"),
            ("(j + 0.5)", "j"),
        ),
        "eye forgotten": ("Where is the camera?", ("e + x * u + y * v", "x * u + y * v")),
        "looks backwards": ("Where is the scene?", ("ray.direction = w", "ray.direction = -w")),
        "u and v exchanged": ("Which axis is horizontal?", ("e + x * u + y * v", "e + y * u + x * v")),
    },
}
