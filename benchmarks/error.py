"""Is the estimated error of a picture true?

python -m benchmarks.error [calibration | glints | elsewhere ...]
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import taichi_tracer as tt
from benchmarks.measure import describe_machine
from benchmarks.scenes import SPHERES_VIEW, three_spheres
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.picture.metrics import relative_rmse

CELL_RENDERS, CELL_SIZE, CELL_SPP, CELL_REFERENCE = 100, 48, (16, 64), 4096  # of direct light
REFERENCE_SEED = 10**6  # of the picture that errors are measured against
MESHES = ("blob", "caustic_sphere", "cornell_box", "cube", "many_lights", "specular_spheres", "sphere", "torus_knot")
MESHES += ("veach_plates", "white_room")
ENVIRONMENTS, ESTIMATORS = ("studio", "sunny", "white"), ("mis", "environment", "brdf")


def calibration() -> str:
    """A table: how often the interval contains the true error of direct light, over many short renders.

    Every shipped mesh, with one of three environments, by three estimators.
    """
    scenes = [
        (name, environment, lambda n=name, e=environment: tt.load_scene_data(n, environment=e))
        for name in MESHES
        for environment in ENVIRONMENTS
    ]
    return table_of_cells(scenes)


def glints() -> str:
    """The same where the edge of a glossy sphere reflects a small sun; two of these cells chose ``ONE_SAMPLE``."""
    return table_of_cells(under("three spheres", three_spheres, SPHERES_VIEW, tuple(SKIES)[:4]))


def elsewhere() -> str:
    """The same for scenes and environments by which no threshold of the package was chosen."""
    scenes = under("pillars", pillars, PILLARS_VIEW, tuple(SKIES)[:4])
    return table_of_cells(scenes + under("marbles", marbles, MARBLES_VIEW, tuple(SKIES)[4:]))


def under(name: str, mesh: Callable[[], Mesh], view: dict, skies: tuple[str, ...]) -> list[tuple[str, str, Callable]]:
    """A mesh under each of some skies, for ``table_of_cells``."""
    return [(name, sky, lambda s=sky: tt.SceneData(mesh(), view=view, environment=SKIES[s]())) for sky in skies]


def sky_with(*suns: tuple[tuple[float, float, float], float, float], ground: float = 0.2) -> np.ndarray:
    """(128, 256, 3) radiance: a sky that is brightest at the horizon, and suns (direction, degrees, radiance)."""
    height, width = 128, 256
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    elevation, azimuth = np.pi * (0.5 - v), 2 * np.pi * (u - 0.5)
    d = np.stack([np.cos(elevation) * np.cos(azimuth), np.sin(elevation), np.cos(elevation) * np.sin(azimuth)], -1)
    sky = np.where(d[..., 1:2] > 0, 1 - 0.5 * d[..., 1:2], ground) * np.array([0.6, 0.7, 0.9])
    for direction, degrees, radiance in suns:
        towards = np.array(direction) / np.linalg.norm(direction)
        sky[d @ towards > np.cos(np.radians(degrees))] += radiance
    return sky


SKIES = {
    "overcast": sky_with,
    "low sun, 3 degrees": lambda: sky_with(((0.7, 0.25, 0.4), 3.0, 400.0)),
    "two suns, 2 and 1.5 degrees": lambda: sky_with(((0.3, 1.0, 0.5), 2.0, 900.0), ((-1.0, 0.4, 0.6), 1.5, 250.0)),
    "a sun behind, 1.5 degrees": lambda: sky_with(((-0.2, 0.5, -1.0), 1.5, 3000.0)),
    "noon, sun of 1.6 degrees": lambda: sky_with(((0.1, 1.0, -0.15), 1.6, 1500.0), ground=0.05),
    "evening, sun of 2.5 degrees": lambda: sky_with(((0.5, 0.12, -1.0), 2.5, 300.0), ground=0.1),
    "a window of 12 degrees": lambda: sky_with(((1.0, 0.6, 0.5), 12.0, 15.0), ground=0.0) * 0.2,
}
PILLARS_VIEW = {"eye": (2.5, 2.2, 4.5), "at": (0, 0.6, 0), "up": (0, 1, 0), "fov": 40.0}


MARBLES_VIEW = {"eye": (-1.0, 1.1, 4.2), "at": (0, 0.35, -0.2), "up": (0, 1, 0), "fov": 38.0}


def marbles() -> Mesh:
    """Five spheres (Ns 5, 40, 120, 500 and a mirror) of different sizes before a wall, on a glossy floor."""
    materials = [Material("floor", Kd=(0.4, 0.45, 0.5), Ns=30.0), Material("wall", Kd=(0.7, 0.65, 0.6))]
    materials += [Material(f"Ns {ns:g}", Kd=(0.75, 0.6, 0.5), Ns=ns) for ns in (5.0, 40.0, 120.0, 500.0, 1e8)]
    floor = [[-5, 0, 5], [5, 0, 5], [5, 0, -2], [-5, 0, -2]]
    wall = [[-5, 0, -2], [5, 0, -2], [5, 1.2, -2], [-5, 1.2, -2]]
    radii, places = (0.25, 0.5, 0.35, 0.6, 0.3), ((-1.5, 0.6), (-0.8, -0.5), (0.1, 0.5), (0.9, -0.6), (1.1, 0.7))
    return Mesh(
        vertices=np.array(floor + wall, float),
        faces=np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], np.int32),
        face_materials=np.array([0, 0, 1, 1], np.int32),
        materials=materials,
        spheres=np.array([[x, r, z, r] for r, (x, z) in zip(radii, places, strict=True)]),
        sphere_materials=np.arange(2, 7, dtype=np.int32),
    )


def pillars() -> Mesh:
    """Nine boxes of three materials (Ns 1, 60 and a mirror) on a floor, each turned and as high as it happens."""
    rng = np.random.default_rng(11)
    materials = [Material("floor", Kd=(0.6, 0.6, 0.55)), Material("matte", Kd=(0.7, 0.3, 0.2))]
    materials += [Material("glossy", Kd=(0.5, 0.6, 0.7), Ns=60.0), Material("mirror", Kd=(0.9, 0.9, 0.9), Ns=1e8)]
    vertices = [np.array([[-5, 0, 5], [5, 0, 5], [5, 0, -5], [-5, 0, -5]], float)]
    faces, ids, first = [[0, 1, 2], [0, 2, 3]], [0, 0], 4
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (0, 1) for z in (-1, 1)], float)
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    for k in range(9):
        angle, height = rng.uniform(0, np.pi / 2), rng.uniform(0.3, 1.6)
        turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
        place = np.array([(k % 3 - 1) * 1.2, 0, (k // 3 - 1) * 1.2])
        vertices.append(corners * (0.25, height, 0.25) @ turn.T + place)
        for a, b, c, d in quads:
            faces += [[first + a, first + b, first + c], [first + a, first + c, first + d]]
            ids += [1 + k % 3] * 2
        first += 8
    return Mesh(
        vertices=np.concatenate(vertices),
        faces=np.array(faces, np.int32),
        face_materials=np.array(ids, np.int32),
        materials=materials,
    )


def table_of_cells(scenes: list[tuple[str, str, Callable[[], tt.SceneData]]]) -> str:
    """A row for each scene, estimator and number of samples. The references are made with MIS, whose mean is the same.

    Args:
        scenes: the name of the scene, that of its light, and what makes it.
    """
    lines = [f"\n**the 95 % interval, over {CELL_RENDERS} renders of {CELL_SIZE}² of every cell**\n"]
    columns = "scene", "environment", "estimator", "samples", "inside", "above", "above 2 ×", "told / true"
    lines += [f"| {' | '.join((*columns, 'upper end / true', 'true', 'reference'))} |", "|---|---|---|" + "--:|" * 8]
    cells = []
    for name, environment, make in scenes:
        scene = make()
        truth = tt.A2Renderer(scene, CELL_SIZE, CELL_SIZE, seed=REFERENCE_SEED).use("mis").render(CELL_REFERENCE)
        for way in ESTIMATORS:
            renderer = tt.A2Renderer(scene, CELL_SIZE, CELL_SIZE).use(way)
            for samples, found in zip(CELL_SPP, cell(renderer, truth.image(), float(truth.error())), strict=True):
                cells.append((environment, found))
                head = f"| {name} | {environment} | {way} | {samples} | {found.columns()}"
                lines.append(f"{head} | {truth.error():.2%} |")
                print(lines[-1], file=sys.stderr, flush=True)
        scene.destroy()
    return "\n".join([*lines, "", *summary(cells)]) + "\n"


@dataclass
class Cell:
    """The errors of many renders of one cell: (n,) arrays of what was told and of the truth.

    ``reference`` is the error of the reference. What is smaller than twice this error cannot be judged: in a room whose
    samples are all alike, a picture is more exact than its reference.
    """

    told: np.ndarray
    low: np.ndarray
    high: np.ndarray
    true: np.ndarray
    reference: float

    @property
    def is_inside(self) -> np.ndarray:
        """Whether the interval contains the truth; a render that says "unknown" tells nothing wrong."""
        return ~(self.true > np.hypot(self.high, 2 * self.reference)) & ~(self.true < self.low - 2 * self.reference)

    @property
    def width(self) -> float:
        """The median of the upper end over the truth."""
        judged = self.true > 2 * self.reference
        return float(np.nanmedian(self.high[judged] / self.true[judged])) if judged.any() else math.nan

    def told_wrong(self, factor: float = 1.0) -> float:
        """The share of renders in which the truth is above the upper end by more than a factor."""
        return float((self.true > np.hypot(factor * self.high, 2 * self.reference)).mean())

    def columns(self) -> str:
        """The columns of the table."""
        ratio = math.exp(np.log(np.maximum(self.told, 1e-12) / self.true).mean())
        shares = f"{self.is_inside.mean():.0%} | {self.told_wrong():.0%} | {self.told_wrong(2):.0%}"
        return f"{shares} | {ratio:.2f} | {self.width:.2f} | {np.median(self.true):.1%}"


def cell(renderer, truth: np.ndarray, reference: float) -> list[Cell]:
    """A ``Cell`` for each of ``CELL_SPP``; the seeds are the same."""
    rows: list[list[tuple]] = [[] for _ in CELL_SPP]
    for seed in range(CELL_RENDERS):
        renderer.seed = seed
        renderer.begin_anew()
        done = 0
        for k, samples in enumerate(CELL_SPP):
            error = renderer.render(samples - done).error()
            done = samples
            true = relative_rmse(renderer.image(), truth.astype(np.float64))
            rows[k].append((float(error), error.low, error.high, true))
    return [Cell(*np.array(found).T, reference) for found in rows]


def summary(cells: list[tuple[str, Cell]]) -> list[str]:
    """What the table must reach, in sentences."""
    inside = np.mean([one.is_inside.mean() for _, one in cells])
    worst = min(float(one.is_inside.mean()) for _, one in cells)
    wrong = np.mean([one.told_wrong(2) for _, one in cells])
    wide = {sunny: [one.width for name, one in cells if ("sun" in name) == sunny] for sunny in (False, True)}
    of_even, of_sunny = (f"{np.nanmedian(wide[sunny]):.2f} and {np.nanmax(wide[sunny]):.2f}" for sunny in (False, True))
    return [
        f"Of all renders, the interval holds the truth in {inside:.1%}; of the worst cell, in {worst:.0%}.",
        f"The truth is more than twice the upper end in {wrong:.2%}.",
        f"Upper end / true, median and largest of the cells: {of_even} without a sun, {of_sunny} with one.",
    ]


PARTS = {
    "calibration": calibration,
    "glints": glints,
    "elsewhere": elsewhere,
}


if __name__ == "__main__":
    tt.init(arch="auto")
    print(describe_machine() + "".join(PARTS[name]() for name in sys.argv[1:] or PARTS))
