"""The known mistakes of RT3's phase 2: each is a small change of the solution."""

from taichi_tracer.teaching.base import mistake

MATRIX, SCREEN = "PerspectiveCamera.compute_matrix", "PerspectiveCamera.pixel_to_screen"
RAY, PARALLEL = "PerspectiveCamera.generate_ray", "OrthographicCamera.generate_ray"
DIRECTION = "tm.normalize(w + point.x * u + point.y * v)"

MISTAKES = (
    mistake(
        MATRIX,
        "right-handed frame",
        "Which factor comes first in vup × w?",
        ("np.cross(self.up, w)", "np.cross(w, self.up)"),
    ),
    mistake(
        MATRIX,
        "v turned round",
        "The order of the factors of a cross product matters.",
        ("np.cross(w, u)", "np.cross(u, w)"),
    ),
    mistake(
        MATRIX,
        "w points away from the scene",
        "Where does a left-handed camera look?",
        ("self.at - self.eye", "self.eye - self.at"),
    ),
    mistake(MATRIX, "u not normalised", "How long is a cross product?", ("u = u / np.linalg.norm(u)\n", "u = u + 0\n")),
    mistake(MATRIX, "w not normalised", "How long is the gaze?", ("w = gaze / np.linalg.norm(gaze)", "w = gaze")),
    mistake(MATRIX, "vup taken as v", "Is vup perpendicular to w?", ("v = np.cross(w, u)", "v = self.up")),
    mistake(MATRIX, "matrix transposed", "Are the axes the rows or the columns?", ("return matrix", "return matrix.T")),
    mistake(MATRIX, "eye missing", "Where do the rays start?", ("matrix[:3, 3] = self.eye", "")),
    mistake(
        SCREEN,
        "pixel corner instead of centre",
        "Where are the integer coordinates?",
        ("(i + 0.5)", "i"),
        ("(j + 0.5)", "j"),
    ),
    mistake(SCREEN, "j counts from the top", "Which row is row 0?", ("b + (t - b)", "t - (t - b)")),
    mistake(
        SCREEN,
        "n_x and n_y exchanged",
        "How many columns are there?",
        ("self.width", "self.HEIGHT"),
        ("self.height", "self.width"),
        ("self.HEIGHT", "self.height"),
    ),
    mistake(SCREEN, "l and b forgotten", "Where is the left edge?", ("l + (r", "(r"), ("b + (t", "(t")),
    mistake(
        SCREEN,
        "divided by n - 1",
        "How many pixels is the window wide?",
        ("/ self.width", "/ (self.width - 1)"),
        ("/ self.height", "/ (self.height - 1)"),
    ),
    mistake(
        SCREEN,
        "window taken as [-1, 1]",
        "What does screen_window say?",
        ("l, r, b, t = self.edges()", "l, r, b, t = -1.0, 1.0, -1.0, 1.0"),
    ),
    mistake(
        RAY,
        "direction not normalised",
        "How long should the direction be?",
        (DIRECTION, "w + point.x * u + point.y * v"),
    ),
    mistake(
        RAY,
        "w forgotten",
        "In which direction does the window stand?",
        (DIRECTION, "tm.normalize(point.x * u + point.y * v)"),
    ),
    mistake(
        RAY,
        "origin on the window",
        "Which point do all rays of this camera share?",
        ("ray.origin = e", "ray.origin = e + point.x * u + point.y * v"),
    ),
    mistake(
        RAY,
        "u and v exchanged",
        "Which axis is horizontal?",
        (DIRECTION, "tm.normalize(w + point.y * u + point.x * v)"),
    ),
    mistake(
        RAY, "looks backwards", "Where is the window?", (DIRECTION, "tm.normalize(-w + point.x * u + point.y * v)")
    ),
    mistake(
        RAY,
        "eye taken as a part of the direction",
        "Is the direction a point or a difference?",
        (DIRECTION, "tm.normalize(e + w + point.x * u + point.y * v)"),
    ),
    mistake(
        PARALLEL,
        "rays from the eye",
        "Where does each ray of this camera start?",
        ("ray.origin = e + x * u + y * v", "ray.origin = e"),
    ),
    mistake(
        PARALLEL,
        "perspective direction",
        "Are the rays parallel?",
        ("ray.direction = w", "ray.direction = tm.normalize(w + x * u + y * v)"),
    ),
    mistake(
        PARALLEL,
        "pixel corner instead of centre",
        "Where are the integer coordinates?",
        ("(i + 0.5)", "i"),
        ("(j + 0.5)", "j"),
    ),
    mistake(PARALLEL, "eye forgotten", "Where is the camera?", ("e + x * u + y * v", "x * u + y * v")),
    mistake(PARALLEL, "looks backwards", "Where is the scene?", ("ray.direction = w", "ray.direction = -w")),
    mistake(PARALLEL, "u and v exchanged", "Which axis is horizontal?", ("e + x * u + y * v", "e + y * u + x * v")),
)
