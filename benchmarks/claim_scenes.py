"""The scenes of ``benchmarks.claims``: light that is hard to find. They had no part in choosing anything."""

from collections.abc import Callable, Sequence

import numpy as np

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material, Texture

SEED = 7  # of what is scattered in the scenes


class Parts:
    """Squares and spheres with materials, until they are a scene."""

    def __init__(self, **view) -> None:
        self.view = {"eye": (0, 2.5, 5), "at": (0, 0.5, 0), "up": (0, 1, 0), "fov": 40.0}
        self.view |= {"handedness": "right"} | view
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

    def surface(self, material: int, x: np.ndarray, y: np.ndarray, z: np.ndarray):
        """Add the squares of a grid of points, (m, n) each."""
        points = np.stack([x, y, z], axis=-1)
        quads = np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2).reshape(-1, 4, 3)
        self.corners += list(quads)
        self.ids += [material] * len(quads)
        return self

    def scene(self, **options) -> tt.SceneData:
        """The scene of all parts."""
        faces = [[4 * k + i for i in corner] for k in range(len(self.ids)) for corner in ((0, 1, 2), (0, 2, 3))]
        mesh = Mesh(
            vertices=np.concatenate(self.corners),
            faces=np.array(faces, np.int32),
            face_materials=np.repeat(self.ids, 2).astype(np.int32),
            materials=self.materials,
            corner_uv=np.tile(UNIT_SQUARE[[[0, 1, 2], [0, 2, 3]]], (len(self.ids), 1, 1)),
            spheres=np.array(self.spheres, float).reshape(-1, 4),
            sphere_materials=np.array(self.sphere_ids, np.int32),
        )
        return tt.SceneData(mesh, view=self.view, **options)


CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))
UNIT_SQUARE = (np.array(CORNERS) + 1) / 2


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
    parts.square(wall, (0, 0, 0), (0, 1, 0), 2).square(wall, (0, 2, 0), (0, -1, 0), 2)
    parts.square(wall, (0, 1, -1), (0, 0, 1), 2).square(wall, (0, 1, 2), (0, 0, -1), 2)
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


def behind_glass() -> tt.SceneData:
    """A lamp smaller than a pixel behind a pane of glass, in view."""
    parts = stage()
    glass = parts.material(Kd=(0, 0, 0), d=0.0, Ni=1.5)
    parts.square(glass, (0.3, 1.2, -0.4), (0, 0, 1), 0.7).square(glass, (0.3, 1.2, -0.5), (0, 0, -1), 0.7)
    return parts.square(parts.lamp(2e4), (0.37, 1.05, -1.2), (0, 0, 1), 0.01).scene()


def starry() -> tt.SceneData:
    """Ninety stars of one texel each, which differ by a factor of 100, above a mirror sphere and a matte one."""
    parts, rng = stage(0), np.random.default_rng(SEED)
    parts.sphere(parts.material(Kd=(0.9, 0.9, 0.9), Ns=1e15), -0.6, 0.5, 0.4, 0.5).sphere(
        parts.matte(), 0.7, 0.5, 0, 0.5
    )
    sky = np.full((128, 256, 3), 0.05)
    sky[rng.integers(0, 60, 90), rng.integers(0, 256, 90)] = 10.0 ** rng.uniform(0.5, 2.5, (90, 1))
    return parts.scene(environment=sky)


def scan() -> tt.SceneData:
    """A rough surface of 20,000 triangles like a scan, under a window and a small lamp."""
    parts, rng = stage(0), np.random.default_rng(SEED)
    theta, phi = np.meshgrid(np.linspace(0, np.pi, 71), np.linspace(0, 2 * np.pi, 141), indexing="ij")
    radius = 0.6 + 0.01 * rng.standard_normal(theta.shape) + 0.08 * np.sin(5 * theta) * np.cos(4 * phi)
    radius[:, -1] = radius[:, 0]
    sine = np.sin(theta)
    place = (radius * sine * np.cos(phi), 0.7 + radius * np.cos(theta), radius * sine * np.sin(phi))
    parts.surface(parts.matte(0.7), *(values.T for values in place))
    parts.square(parts.lamp(8), (-3, 2, 1), (1, -0.2, -0.2), 0.8)
    return parts.square(parts.lamp(1e3), (1.5, 3, 2), (-0.3, -1, -0.5), 0.04).scene()


def textured() -> tt.SceneData:
    """A floor of a fine and coloured pattern, and a small lamp close above it."""
    parts, rng = stage(1.0), np.random.default_rng(SEED)
    pattern = Texture(rng.uniform(0.02, 0.95, (64, 64, 3)))
    parts.square(parts.material(Kd=(1, 1, 1), map_Kd=pattern), (0, 0.01, 1), (0, 1, 0), 1.8)
    return parts.square(parts.lamp(500), (0.4, 0.12, 1.2), (0, -1, 0), 0.05).scene()


SCENES: dict[str, Callable[[], tt.SceneData]] = {
    make.__name__: make
    for make in (small_in_view, small_out_of_view, behind_poles, above_glass, before_mirror, two_hundred, star, slit)
}
SCENES |= {make.__name__: make for make in (indirect, plates, small_spheres, glass_and_many)}
SCENES |= {make.__name__: make for make in (behind_glass, starry, scan, textured)}
