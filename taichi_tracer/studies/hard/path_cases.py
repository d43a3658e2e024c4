"""Hard cases of light that bounces: rooms without a way out, lamps where formulas are 0/0, lamps without a size."""

import warnings

import numpy as np

from taichi_tracer.camera import Camera
from taichi_tracer.cameras.orthographic import OrthographicCamera
from taichi_tracer.geometry import Mesh
from taichi_tracer.integrators.path_settings import MOST_BOUNCES
from taichi_tracer.materials import Material
from taichi_tracer.renderer import A4Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.hard import oracle
from taichi_tracer.studies.hard.case import RendererCase, scene_without_warnings
from taichi_tracer.studies.hard.meshes import box, join, separate, sphere
from taichi_tracer.system.parts.registry import PARTS

WAYS = ("implicit", "explicit", "path")
DEVIATIONS = 8  # that the mean of a pixel may be off by: far from a normal distribution, single samples are very bright
PIXEL = 2.0**-23  # ε of a picture, whose pixels are f32 numbers in every precision
ALBEDO = 0.5
FLOOR = Material(name="floor", Kd=(ALBEDO,) * 3)


def lamp(radiance: float = 1.0, **values) -> Material:
    """A black surface that emits."""
    return Material(name="lamp", Kd=(0.0,) * 3, Ke=(radiance,) * 3, **values)


def mesh_of(parts, materials) -> Mesh:
    """A ``Mesh`` of several (vertices, faces), part i of material i."""
    vertices, faces = join(parts)
    owners = np.repeat(np.arange(len(parts)), [len(f) for _, f in parts]).astype(np.int32)
    return Mesh(vertices=vertices, faces=faces, face_materials=owners, materials=list(materials))


def quad(*corners) -> tuple[np.ndarray, np.ndarray]:
    """Four corners, counter-clockwise, as two triangles."""
    a, b, c, d = (np.asarray(corner, float) for corner in corners)
    return separate([[a, b, c], [a, c, d]])


def square(half: float, y: float = 0.0, centre=(0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """A horizontal square whose front looks up."""
    (x, z), h = centre, half
    return quad((x - h, y, z + h), (x + h, y, z + h), (x + h, y, z - h), (x - h, y, z - h))


def from_above(size: int, half: float, height: float = 0.5, turn: np.ndarray | None = None) -> OrthographicCamera:
    """A camera that looks down at ``square(half)``; +x is on the right of the picture, and +z at its top."""
    turn = np.eye(3) if turn is None else turn
    place = {"eye": turn @ (0, height, 0), "at": (0, 0, 0), "up": turn @ (0, 0, 1)}
    return OrthographicCamera(size, size, **place, screen_window=(-half, half, -half, half))


def floor_points(size: int, half: float) -> np.ndarray:
    """(size, size, 3) points of the floor that the pixels of such a camera show, top row first."""
    centres = (np.arange(size) + 0.5) / size * 2 * half - half
    x, z = np.meshgrid(centres, centres[::-1])
    return np.stack([x, np.zeros_like(x), z], axis=-1)


def reflected(point, corners) -> float:
    """The radiance of the floor at a point, under a lamp of radiance 1 with these corners."""
    return ALBEDO / np.pi * oracle.polygon_irradiance(point, np.array([0.0, 1, 0]), corners)


def path_renderer(scene: SceneData, camera: Camera | None = None, bounces: int = 1, **options) -> A4Renderer:
    """A renderer of paths whose samples pass through the middles of pixels."""
    renderer = A4Renderer(scene, camera=camera, **{"jitter": False} | options)
    renderer.max_bounces = bounces
    return renderer


def rendered(renderer: A4Renderer, way: str, spp: int) -> tuple[np.ndarray, np.ndarray, int]:
    """(h, w, 3) mean, (h, w, 3) standard deviation of the mean, and how many samples or pixels are no numbers."""
    renderer.use(way)
    renderer.begin_anew()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a scene without light is what some cases are about
        renderer.render(spp)
    image = renderer.image().astype(np.float64)
    deviation = np.sqrt(np.nan_to_num(renderer.film.variance_of_mean().astype(np.float64)))
    return image, deviation, int(renderer.non_finite + (~np.isfinite(image)).any(axis=2).sum())


class ClosedRoom(RendererCase):
    """A room without a way out, in which every surface reflects 3/4 and emits 1/8; paths of 64 bounces.

    A ray that starts a little behind a wall, or that passes between two walls, is lost together with the light of all
    its further bounces: dark dots. A weight that is a little too large is multiplied 64 times. A closed room shows
    both: its radiance is the sum of a geometric series everywhere.
    """

    name = "closed white room, 64 bounces"
    emission, albedo = 0.125, 0.75

    def check(self, found, epsilon):
        """With implicit paths, every sample is the sum; with the other ways, the mean is."""
        white = Material(name="white", Kd=(self.albedo,) * 3, Ke=(self.emission,) * 3)
        (vertices, faces), block = box((-1.5, -1, -2), (1.5, 1.25, 3)), sphere(16, 8, 0.4, (0.3, -0.25, 0.1))
        mesh = mesh_of([(vertices, faces[:, ::-1]), block], [white, white])
        scene = SceneData(mesh, view={"eye": (0, 0, 2.5), "at": (0.1, 0, 0), "fov": 60.0})
        renderer = path_renderer(scene, None, MOST_BOUNCES, width=48, height=48, jitter=True)
        truth = self.emission * sum(self.albedo**k for k in range(MOST_BOUNCES + 1))
        for way, spp in zip(WAYS, (16, 4, 4), strict=True):
            image, _, nan = rendered(renderer, way, spp)
            off = np.abs(image[..., 0] / truth - 1)
            if way == "implicit":
                found.add(off > 4 * MOST_BOUNCES * max(epsilon, PIXEL), nan)
            else:
                error = image[..., 0].std() / np.sqrt(off.size)
                found.add(abs(image.mean() - truth) > DEVIATIONS * error, nan, off.size)


class MirrorCorridor(RendererCase):
    """Two mirrors face each other, reflect everything, and emit: light goes to and fro for ever.

    A loop that waits until a ray leaves the scene never ends here. Only ``max_bounces`` ends it.
    """

    name = "mirror corridor, 0 to 64 bounces"

    def check(self, found, epsilon):
        """After k bounces the eye, which looks along the normal, sees the emission of k + 1 surfaces."""
        mirror = Material(name="mirror", Kd=(1.0,) * 3, Ke=(1.0,) * 3, Ns=1e38)  # in f64, too
        near = quad((-9, -9, 1), (-9, 9, 1), (9, 9, 1), (9, -9, 1))
        far = quad((-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1))
        scene = SceneData(mesh_of([near, far], [mirror, mirror]))
        window = (-0.5, 0.5, -0.5, 0.5)
        camera = OrthographicCamera(8, 8, eye=(0.1, 0.2, 0.5), at=(0.1, 0.2, -1), up=(0, 1, 0), screen_window=window)
        renderer = A4Renderer(scene, camera=camera)
        for way in WAYS:
            for bounces in (0, 1, 2, MOST_BOUNCES):
                renderer.max_bounces = bounces
                image, _, nan = rendered(renderer, way, 1)
                off = np.abs(image[..., 0] / (bounces + 1) - 1)
                found.add(off > 4 * (bounces + 1) * max(epsilon, PIXEL), nan)


class LampInPlace(RendererCase):
    """A lamp beside a floor. A subclass says where.

    Attributes:
        corners: (4, 3) of the lamp, counter-clockwise as seen from the side that emits.
        size: pixels of a picture of the floor from above, whose side is ``2 * half``.
    """

    corners: np.ndarray

    size, half, spp = 33, 2.0, 256
    turn = np.eye(3)  # of the whole scene

    def check(self, found, epsilon):
        """The floor's radiance is that of Lambert's formula for polygons; it is 0 behind the lamp and in its plane."""
        floor = square(self.half, centre=(0, 0))
        parts = [(v @ self.turn.T, f) for v, f in (floor, quad(*self.corners))]
        scene = SceneData(mesh_of(parts, [FLOOR, lamp()]))
        renderer = path_renderer(scene, from_above(self.size, self.half, 4, self.turn), sampler="independent")
        points = floor_points(self.size, self.half)
        truth = np.array([[reflected(p, self.corners) for p in row] for row in points])
        for way in ("explicit", "path"):
            image, deviation, nan = rendered(renderer, way, self.spp)
            off = np.abs(image[..., 0] - truth) > DEVIATIONS * deviation[..., 0] + 64 * epsilon
            found.add(off[self.sees_floor(points)], nan)

    def sees_floor(self, points) -> np.ndarray:
        """(size, size) bool: whether a pixel shows the floor and not the lamp."""
        return np.ones(points.shape[:2], bool)


class LampInTheFloor(LampInPlace):
    """The lamp lies in the plane of the floor, and the plane is tilted.

    Exactly, cos θ is 0 at both ends of every shadow ray, and nothing is lit. Rounded, cos θ is some 1e-7 of either
    sign, or 0. The density |x − y|²/(A cos θ) is then huge, negative or infinite, and the sample can be 0/0.
    """

    name = "lamp in the plane of its receiver"
    turn = np.linalg.qr(np.array([[2.0, 1, 0.5], [-1, 3, 0.7], [0.3, -0.6, 2.5]]))[0]
    turn = turn * np.sign(np.linalg.det(turn))

    corners = np.array([[-0.5, 0, 0.5], [0.5, 0, 0.5], [0.5, 0, -0.5], [-0.5, 0, -0.5]])

    def sees_floor(self, points):
        """Not where the two coincide: there, either of them is the hit."""
        return (np.abs(points[..., [0, 2]]) > 0.51).any(axis=-1)


class LampAtTheFloor(LampInPlace):
    """The lamp stands on the floor: they share an edge, and |x − y|² goes to 0 there.

    1/|x − y|² grows without a bound, so that single samples become very bright; |x − y| = 0 is 0/0.
    """

    name = "lamp that touches its receiver"
    corners = np.array([[0, 0, 1], [0, 0, -1], [0, 1, -1], [0, 1, 1]])  # a vertical square at x = 0 that faces +x

    def sees_floor(self, points):
        """Not at x = 0, on the edge itself, where the radiance jumps."""
        return points[..., 0] != 0


class LampEdgeOn(LampInPlace):
    """The lamp hangs in a plane that contains points of the floor, and the eye looks along it, too.

    From these points, the lamp is a line: cos θ_y = 0, and the density is infinite. A sample of it is 0 · ∞ = NaN.
    """

    name = "lamp seen edge-on"
    corners = np.array([[0, 0.5, 1], [0, 0.5, -1], [0, 1.5, -1], [0, 1.5, 1]])  # faces +x


class DegenerateLamps(RendererCase):
    """Emissive triangles without area, with NaN and with infinity beside one that is right.

    In a cumulative distribution of areas, one NaN makes every entry after it NaN, so that the search always ends at the
    same lamp. A triangle without area that is chosen has the density 0/0.
    """

    name = "emissive degenerate triangles"
    corners = np.array([[-0.5, 1, -0.5], [0.5, 1, -0.5], [0.5, 1, 0.5]])  # faces down

    def check(self, found, epsilon):
        """Only the right triangle is a lamp, whichever choice is made, and the floor is lit by it alone."""
        point, line = np.zeros((3, 3)), np.outer([0.0, 1, 2], [1, 1, 1])
        broken = [point, line, np.full((3, 3), np.nan), self.corners * [1, np.inf, 1], line + [3, 0, 0]]
        vertices = np.concatenate([*broken[:3], self.corners, *broken[3:]])
        lamps = vertices, np.arange(len(vertices)).reshape(-1, 3)
        good = 2 + 3  # the triangle's number: two of the floor, and three broken ones, come before it
        truth = np.array([[reflected(p, self.corners) for p in row] for row in floor_points(9, 1.0)])
        for choice in PARTS.names("lamp choice"):
            scene = scene_without_warnings(mesh_of([square(2), lamps], [FLOOR, lamp()]), lamp_choice=choice)
            renderer = path_renderer(scene, from_above(9, 1.0), sampler="independent")
            image, deviation, nan = rendered(renderer, "explicit", 256)
            found.add(np.abs(image[..., 0] - truth) > DEVIATIONS * deviation[..., 0] + 64 * epsilon, nan)
            found.add(list(scene.lamps.table.ids) != [good])


class NoLampAtAll(RendererCase):
    """Every surface that emits has the area 0: there is a Ke > 0, and no light.

    The total area of the lamps is 0. Dividing by it, or searching in an empty table, is NaN or a crash.
    """

    name = "total emissive area 0"

    def check(self, found, epsilon):
        """The picture is black, in every way."""
        line = np.outer([0.0, 1, 2], [1.0, 1, 1]), np.array([[0, 1, 2]])
        scene = scene_without_warnings(mesh_of([square(2), line], [FLOOR, lamp()]))
        renderer = A4Renderer(scene, camera=Camera(8, 8, eye=(0, 3, 0.1), at=(0, 0, 0)))
        for way in WAYS:
            image, _, nan = rendered(renderer, way, 4)
            found.add((image != 0).any(axis=2), nan)


class ExtremeRadiance(RendererCase):
    """Lamps with Ke = 1e30 and 1e-30.

    In f32, the square of 1e30 is infinite and that of 1e-30 is 0: a sum of squares, a heuristic of radiances, or a
    power that is not scaled, is lost. The picture has to be that of Ke = 1, times a factor.
    """

    name, spp = "Ke of 1e30 and 1e-30", 64

    def check(self, found, epsilon):
        """Divided by Ke, both pictures and their errors are the same, and the mean is that of Lambert's formula."""
        corners = np.array([[-1.0, 1, -1], [1, 1, -1], [1, 1, 1], [-1, 1, 1]])
        truth = np.array([[reflected(p, corners) for p in row] for row in floor_points(9, 1.0)])
        pictures, errors = [], []
        for radiance in (1e30, 1e-30):
            scene = SceneData(mesh_of([square(2), quad(*corners)], [FLOOR, lamp(radiance)]))
            renderer = path_renderer(scene, from_above(9, 1.0))
            image, _, nan = rendered(renderer, "path", self.spp)
            pictures.append(image[..., 0] / radiance)
            errors.append(float(renderer.error()))
            found.add(np.zeros(truth.shape, bool), nan)
        one, other = pictures
        found.add(np.abs(one / other - 1) > self.spp * PIXEL, tried=0)
        found.add(abs(one.mean() / truth.mean() - 1) > 0.02, tried=0)
        found.add(
            not abs(errors[0] / errors[1] - 1) <= self.spp * PIXEL, tried=0
        )  # one that is not known is wrong, too


class MillionTriangleLamp(RendererCase):
    """A ball of 1e6 triangles that emits, above a floor.

    A cumulative distribution of 1e6 equal steps is at the limit of f32: its last steps are 1e-6, in units of 6e-8.
    Where the density of a lamp is not exactly the probability with which the search finds it, the picture is too dark.
    """

    name = "one lamp of 1e6 triangles"
    radius, height = 0.5, 2.0

    def check(self, found, epsilon):
        """Straight below a ball of radius R at the height h, E = π L (R/h)², whichever choice is made."""
        ball = sphere(1000, 501, self.radius, (0, self.height, 0))
        truth = ALBEDO * (self.radius / self.height) ** 2
        for choice in PARTS.names("lamp choice"):
            scene = SceneData(mesh_of([square(2), ball], [FLOOR, lamp()]), lamp_choice=choice)
            renderer = path_renderer(scene, from_above(16, 0.01), sampler="independent", jitter=True)
            image, _, nan = rendered(renderer, "explicit", 256)
            error = image[..., 0].std() / np.sqrt(image[..., 0].size)
            # The ball is a polyhedron, which is smaller than the ball by some 1e-5.
            found.add(abs(image.mean() - truth) > 4 * error + 1e-4 * truth, nan, image[..., 0].size)


USUAL = (
    ClosedRoom,
    MirrorCorridor,
    LampInTheFloor,
    LampAtTheFloor,
    LampEdgeOn,
    DegenerateLamps,
    NoLampAtAll,
    ExtremeRadiance,
)
LARGE = (MillionTriangleLamp,)
