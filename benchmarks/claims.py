"""Do claims of errors hold where light is hard to find? On scenes that had no part in choosing anything.

Lamps that are smaller than a pixel, in view and out of it, behind poles, above glass and before a mirror; hundreds of
lamps of very different power; a star, a slit, a room that is lit indirectly. Every estimator of A3 and A4, at 1, 3 and
8 bounces, 16 and 64 samples. A cell fails if fewer than 90 % of its renders hold the truth, or if more than 1 % are
wrong by more than twice: a render that says "unknown" is not wrong.

python -m benchmarks.claims [SCENE ...]
"""

import sys
from collections.abc import Callable, Sequence

import numpy as np

import taichi_tracer as tt
from benchmarks.error import Cell
from benchmarks.measure import describe_machine
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.picture.metrics import relative_rmse

SIZE, SPP, RENDERS = 48, (16, 64), 40
REFERENCE_SPP, REFERENCE_SEED = 8192, 10**6
DIRECT, PATHS = (
    ("mis", "environment", "brdf"),
    (("path", 1), ("path", 3), ("path", 8), ("explicit", 3), ("implicit", 3)),
)
LEAST_INSIDE, MOST_WRONG = 0.9, 0.01
SEED = 7  # of what is scattered in the scenes


class Parts:
    """Squares and spheres with materials, until they are a scene."""

    def __init__(self, **view) -> None:
        self.view = {"eye": (0, 2.5, 5), "at": (0, 0.5, 0), "up": (0, 1, 0), "fov": 40.0} | view
        self.materials: list[Material] = []
        self.corners: list[np.ndarray] = []
        self.ids: list[int] = []
        self.spheres: list[tuple] = []
        self.sphere_ids: list[int] = []

    def material(self, **values) -> int:
        """Add a material; its number."""
        self.materials.append(Material(f"m{len(self.materials)}", **values))
        return len(self.materials) - 1

    def matte(self, kd: float = 0.6) -> int:
        """A matte material."""
        return self.material(Kd=(kd, kd, kd))

    def lamp(self, ke: float) -> int:
        """A lamp's material."""
        return self.material(Kd=(0, 0, 0), Ke=(ke, 0.9 * ke, 0.7 * ke))

    def square(self, material: int, centre: Sequence[float], normal: Sequence[float], half: float, tall: float = 0):
        """Add a square, or a rectangle that is ``tall`` in its second direction, whose front looks along a normal."""
        n = np.array(normal, float) / np.linalg.norm(normal)
        a = np.cross([0.0, 1.0, 0.0] if abs(n[1]) < 0.9 else [0.0, 0.0, 1.0], n)
        a /= np.linalg.norm(a)
        b = np.cross(n, a)
        self.corners.append(np.array([np.array(centre) + half * s * a + (tall or half) * t * b for s, t in CORNERS]))
        self.ids.append(material)
        return self

    def sphere(self, material: int, x: float, y: float, z: float, radius: float):
        """Add a sphere."""
        self.spheres.append((x, y, z, radius))
        self.sphere_ids.append(material)
        return self

    def scene(self, **options) -> tt.SceneData:
        """The scene of all parts."""
        faces = [[4 * k + i for i in corner] for k in range(len(self.ids)) for corner in ((0, 1, 2), (0, 2, 3))]
        mesh = Mesh(
            vertices=np.concatenate(self.corners),
            faces=np.array(faces, np.int32),
            face_materials=np.repeat(self.ids, 2).astype(np.int32),
            materials=self.materials,
            spheres=np.array(self.spheres, float).reshape(-1, 4),
            sphere_materials=np.array(self.sphere_ids, np.int32),
        )
        return tt.SceneData(mesh, view=self.view, **options)


CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))


def stage(large: float = 4.0, **view) -> Parts:
    """A floor and a wall under a large lamp."""
    parts = Parts(**view)
    floor = parts.matte()
    parts.square(floor, (0, 0, 0), (0, 1, 0), 4).square(floor, (0, 2, -2), (0, 0, 1), 4)
    if large > 0:
        parts.square(parts.lamp(large), (0, 5, 2), (0, -1, 0), 1.5)
    return parts


def small_in_view() -> tt.SceneData:
    """One lamp of a fiftieth of a pixel before the wall."""
    parts = stage()
    return parts.square(parts.lamp(3e4), (0.53, 1.1, -1), (0, 0, 1), 0.008).scene()


def small_out_of_view() -> tt.SceneData:
    """The same lamp beside the picture."""
    parts = stage()
    return parts.square(parts.lamp(3e4), (4.0, 1.1, -1), (0, 0, 1), 0.008).scene()


def behind_poles() -> tt.SceneData:
    """Seven small lamps behind thin poles, which hide some of them."""
    parts, rng = stage(), np.random.default_rng(SEED)
    pole, lamp = parts.matte(0.3), parts.lamp(2e4)
    for k in range(7):
        parts.square(lamp, (-1.5 + 0.5 * k + rng.uniform(-0.1, 0.1), rng.uniform(0.4, 1.6), -1.2), (0, 0, 1), 0.01)
    for k in range(12):
        parts.square(pole, (-1.8 + 0.3 * k, 1, -0.5), (0, 0, 1), 0.06, 1.2)
    return parts.scene()


def above_glass() -> tt.SceneData:
    """A lamp of 10 cm above a glass sphere."""
    parts = stage()
    parts.square(parts.lamp(2e3), (0.2, 3, 0.1), (0, -1, 0), 0.05)
    return parts.sphere(parts.material(Kd=(0, 0, 0), d=0.0, Ni=1.5), 0, 0.9, 0, 0.5).scene()


def before_mirror() -> tt.SceneData:
    """A lamp of 6 cm that lights the floor over an upright mirror."""
    parts = stage()
    parts.square(parts.lamp(5e3), (0.3, 1, 0), (1, 0, 0), 0.03)
    return parts.square(parts.material(Kd=(1, 1, 1), Ns=1e15), (1.8, 1, 0), (-1, 0, 0), 1).scene()


def two_hundred() -> tt.SceneData:
    """200 lamps on the ceiling, whose powers differ by a factor of 10⁵."""
    parts, rng = stage(0), np.random.default_rng(SEED)
    lamps = [parts.lamp(ke) for ke in 10.0 ** rng.uniform(-1, 4, 20)]
    for k in range(200):
        parts.square(lamps[k % 20], (*rng.uniform(-2, 2, 1), 4, *rng.uniform(-1, 3, 1)), (0, -1, 0), 0.02)
    return parts.scene(lamp_choice="power")


def star() -> tt.SceneData:
    """Twelve long and thin lamps in view, which cross in one point."""
    parts = stage(1.0)
    lamp = parts.lamp(300)
    for k in range(12):
        angle = np.pi * k / 12
        parts.square(lamp, (0.4 + 0.3 * np.cos(angle), 1.2 + 0.3 * np.sin(angle), -1), (0.01 * k, 0, 1), 0.002, 0.3)
    return parts.scene()


def slit() -> tt.SceneData:
    """A lamp behind a screen with a slit of 2 cm."""
    parts = stage(0.2)
    screen = parts.matte(0.2)
    parts.square(screen, (-2.01, 2, 1), (-1, 0, 0.01), 2).square(parts.lamp(400), (-3, 2, 0), (1, 0, 0), 0.2)
    parts.square(screen, (-2, 2, -2.02), (1, 0, 0), 2)
    return parts.scene()


def indirect() -> tt.SceneData:
    """A closed room whose lamp shines onto the ceiling."""
    parts = Parts(eye=(0, 1, 1.8), at=(0, 0.9, 0))
    wall = parts.matte(0.7)
    for centre, normal in (
        ((0, 0, 0), (0, 1, 0)),
        ((0, 2, 0), (0, -1, 0)),
        ((0, 1, -1), (0, 0, 1)),
        ((0, 1, 2), (0, 0, -1)),
    ):
        parts.square(wall, centre, normal, 2)
    parts.square(wall, (-1, 1, 0), (1, 0, 0), 2).square(wall, (1, 1, 0), (-1, 0, 0), 2)
    return parts.square(parts.lamp(60), (0.3, 1.7, -0.2), (0, 1, 0), 0.1).scene()


def plates() -> tt.SceneData:
    """Four glossy plates under lamps of four sizes and the same power."""
    parts = stage(0)
    for k, ns in enumerate((20.0, 200.0, 2000.0, 20000.0)):
        tilt = 0.5 + 0.25 * k
        parts.square(
            parts.material(Kd=(0.5, 0.5, 0.5), Ns=ns), (0, 0.2 + 0.35 * k, 0.8 - 0.5 * k), (0, 1, tilt), 1.2, 0.15
        )
    for k, half in enumerate((0.02, 0.06, 0.18, 0.5)):
        parts.square(parts.lamp(4 / half**2), (-1.5 + k, 3.5, 1), (0, -1, 0.2), half)
    return parts.scene()


def small_spheres() -> tt.SceneData:
    """Forty small lamps that are spheres, in the air before the wall."""
    parts, rng = stage(), np.random.default_rng(SEED)
    lamp = parts.lamp(5e3)
    for _ in range(40):
        parts.sphere(lamp, *rng.uniform((-1.5, 0.2, -1.5), (1.5, 1.8, 0.5)), 0.004)
    return parts.scene()


def glass_and_many() -> tt.SceneData:
    """Two glass spheres and a mirror sphere under five lamps of different size."""
    parts, rng = stage(1.0), np.random.default_rng(SEED)
    glass, mirror = parts.material(Kd=(0, 0, 0), d=0.0, Ni=1.5), parts.material(Kd=(0.95, 0.95, 0.95), Ns=1e15)
    parts.sphere(glass, -0.8, 0.5, 0.3, 0.4).sphere(glass, 0.7, 0.4, 0.6, 0.3).sphere(mirror, 0.1, 0.5, -0.7, 0.45)
    for half in (0.03, 0.05, 0.1, 0.2, 0.4):
        parts.square(parts.lamp(3 / half**2), (rng.uniform(-2, 2), 3.5, rng.uniform(-1, 2)), (0, -1, 0), half)
    return parts.scene()


SCENES: dict[str, Callable[[], tt.SceneData]] = {
    make.__name__: make
    for make in (small_in_view, small_out_of_view, behind_poles, above_glass, before_mirror, two_hundred, star, slit)
}
SCENES |= {make.__name__: make for make in (indirect, plates, small_spheres, glass_and_many)}


def renderer_of(scene: tt.SceneData, way: str, bounces: int, seed: int = 0):
    """A renderer of direct light, or of paths."""
    if bounces == 0:
        return tt.A3Renderer(scene, SIZE, SIZE, seed=seed).use(way)
    renderer = tt.A4Renderer(scene, SIZE, SIZE, seed=seed).use(way)
    renderer.active.change("max_bounces", bounces)
    return renderer


def cells_of(scene: tt.SceneData) -> list[tuple[str, int, Cell, int]]:
    """(estimator, samples, cell, renders that said "unknown") of a scene."""
    found, references = [], {}
    for way, bounces in [*((way, 0) for way in DIRECT), *PATHS]:
        if bounces not in references:
            truth = renderer_of(scene, "mis" if bounces == 0 else "path", bounces, REFERENCE_SEED).render(REFERENCE_SPP)
            references[bounces] = truth.image(), float(np.nan_to_num(float(truth.error()), nan=1.0))
        truth, error = references[bounces]
        renderer = renderer_of(scene, way, bounces)
        rows: dict[int, list[tuple]] = {samples: [] for samples in SPP}
        for seed in range(RENDERS):
            renderer.seed = seed
            renderer.begin_anew()
            done = 0
            for samples in SPP:
                told = renderer.render(samples - done).error()
                done = samples
                true = relative_rmse(renderer.image(), truth.astype(np.float64))
                rows[samples].append((float(told), told.low, told.high, true))
        name = f"{way}, {bounces} bounces" if bounces else way
        for samples, row in rows.items():
            numbers = np.array(row)
            found.append((name, samples, Cell(*numbers.T, error), int(np.isnan(numbers[:, 0]).sum())))
    return found


def main() -> None:
    """Print a row for each cell, and how many fail."""
    print(describe_machine())
    print(f"\n{SIZE}², {RENDERS} renders of every cell, references with {REFERENCE_SPP:,} samples\n")
    columns = (
        "scene",
        "estimator",
        "samples",
        "holds",
        "wrong by 2 ×",
        "unknown",
        "upper end / true",
        "true",
        "reference",
    )
    print(f"| {' | '.join(columns)} | |\n|---|---|--:|--:|--:|--:|--:|--:|--:|---|", flush=True)
    failed = count = 0
    for name in sys.argv[1:] or SCENES:
        scene = SCENES[name]()
        for way, samples, one, unknown in cells_of(scene):
            holds, wrong = one.is_inside.mean(), one.told_wrong(2)
            fails = bool(holds < LEAST_INSIDE or wrong > MOST_WRONG)
            failed, count = failed + fails, count + 1
            numbers = f"{holds:.0%} | {wrong:.0%} | {unknown} | {one.width:.2f} | {np.median(one.true):.1%}"
            print(f"| {name} | {way} | {samples} | {numbers} | {one.reference:.1%} | {'fails' * fails} |", flush=True)
        scene.destroy()
    print(f"\n{failed} of {count} cells fail.")


if __name__ == "__main__":
    tt.init(arch="auto")
    main()
