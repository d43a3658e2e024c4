"""Hard cases of light that bounces: rooms without a way out, lamps where formulas are 0/0, lamps without a size."""

import warnings
from collections.abc import Callable

import numpy as np

from taichi_tracer.camera import Camera
from taichi_tracer.cameras.orthographic import OrthographicCamera
from taichi_tracer.geometry import Mesh
from taichi_tracer.integrators.path_settings import MOST_BOUNCES
from taichi_tracer.materials import Material
from taichi_tracer.renderer import A4Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.hard import oracle
from taichi_tracer.studies.hard.case import LARGE, USUAL, renderer_case, scene_without_warnings
from taichi_tracer.studies.hard.meshes import box, join, separate, sphere
from taichi_tracer.system.parts.registry import PARTS

WAYS = ("implicit", "explicit", "path")
DEVIATIONS = 8  # that the mean of a pixel may be off by: far from a normal distribution, single samples are very bright
PIXEL = 2.0**-23  # ε of a picture, whose pixels are f32 numbers in every precision
ALBEDO = 0.5
UNTURNED = np.eye(3)
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


def from_above(size: int, half: float, height: float = 0.5, turn: np.ndarray = UNTURNED) -> OrthographicCamera:
    """A camera that looks down at ``square(half)``; +x is on the right of the picture, and +z at its top."""
    place = {"eye": turn @ (0, height, 0), "at": (0, 0, 0), "up": turn @ (0, 0, 1)}
    return OrthographicCamera(size, size, **place, screen_window=(-half, half, -half, half))


def floor_points(size: int, half: float) -> np.ndarray:
    """(size, size, 3) points of the floor that the pixels of such a camera show, top row first."""
    centres = (np.arange(size) + 0.5) / size * 2 * half - half
    x, z = np.meshgrid(centres, centres[::-1])
    return np.stack([x, np.zeros_like(x), z], axis=-1)


def reflected(points, corners) -> np.ndarray:
    """(h, w) the radiance of the floor at (h, w, 3) points, under a lamp of radiance 1 with these corners."""
    up = np.array([0.0, 1, 0])
    return ALBEDO / np.pi * np.array([[oracle.polygon_irradiance(p, up, corners) for p in row] for row in points])


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


@renderer_case("closed white room, 64 bounces")
def closed_room(found, epsilon):
    """A room without a way out, in which every surface reflects 3/4 and emits 1/8; paths of 64 bounces.

    A ray that starts a little behind a wall, or that passes between two walls, is lost together with the light of all
    its further bounces: dark dots. A weight that is a little too large is multiplied 64 times. A closed room shows
    both: its radiance is the sum of a geometric series everywhere. With implicit paths, every sample is the sum; with
    the other ways, the mean is.
    """
    emission, albedo = 0.125, 0.75
    white = Material(name="white", Kd=(albedo,) * 3, Ke=(emission,) * 3)
    (vertices, faces), block = box((-1.5, -1, -2), (1.5, 1.25, 3)), sphere(16, 8, 0.4, (0.3, -0.25, 0.1))
    mesh = mesh_of([(vertices, faces[:, ::-1]), block], [white, white])
    scene = SceneData(mesh, view={"eye": (0, 0, 2.5), "at": (0.1, 0, 0), "fov": 60.0})
    renderer = path_renderer(scene, None, MOST_BOUNCES, width=48, height=48, jitter=True)
    truth = emission * sum(albedo**k for k in range(MOST_BOUNCES + 1))
    for way, spp in zip(WAYS, (16, 4, 4), strict=True):
        image, _, nan = rendered(renderer, way, spp)
        off = np.abs(image[..., 0] / truth - 1)
        if way == "implicit":
            found.add(off > 4 * MOST_BOUNCES * max(epsilon, PIXEL), nan)
        else:
            error = image[..., 0].std() / np.sqrt(off.size)
            found.add(abs(image.mean() - truth) > DEVIATIONS * error, nan, off.size)


@renderer_case("mirror corridor, 0 to 64 bounces", USUAL)
def mirror_corridor(found, epsilon):
    """Two mirrors face each other, reflect everything, and emit: light goes to and fro for ever.

    A loop that waits until a ray leaves the scene never ends here. Only ``max_bounces`` ends it. After k bounces the
    eye, which looks along the normal, sees the emission of k + 1 surfaces.
    """
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


def check_lamp(
    found, epsilon, corners, sees_floor: Callable[[np.ndarray], np.ndarray], turn: np.ndarray = UNTURNED
) -> None:
    """Whether the floor under a lamp has the radiance of Lambert's formula: 0 behind the lamp and in its plane.

    Args:
        corners: (4, 3) of the lamp, counter-clockwise as seen from the side that emits.
        sees_floor: (size, size, 3) points of the floor → (size, size) bool, whether the floor is seen there.
        turn: (3, 3) of the whole scene.
    """
    size, half = 33, 2.0
    parts = [(v @ turn.T, f) for v, f in (square(half), quad(*corners))]
    scene = SceneData(mesh_of(parts, [FLOOR, lamp()]))
    renderer = path_renderer(scene, from_above(size, half, 4, turn), sampler="independent")
    points = floor_points(size, half)
    truth = reflected(points, corners)
    for way in ("explicit", "path"):
        image, deviation, nan = rendered(renderer, way, 256)
        off = np.abs(image[..., 0] - truth) > DEVIATIONS * deviation[..., 0] + 64 * epsilon
        found.add(off[sees_floor(points)], nan)


@renderer_case("lamp in the plane of its receiver", USUAL)
def lamp_in_the_floor(found, epsilon):
    """The lamp lies in the plane of the floor, and the plane is tilted.

    Exactly, cos θ is 0 at both ends of every shadow ray, and nothing is lit. Rounded, cos θ is some 1e-7 of either
    sign, or 0. The density |x − y|²/(A cos θ) is then huge, negative or infinite, and the sample can be 0/0.
    """
    turn = np.linalg.qr(np.array([[2.0, 1, 0.5], [-1, 3, 0.7], [0.3, -0.6, 2.5]]))[0]
    corners = np.array([[-0.5, 0, 0.5], [0.5, 0, 0.5], [0.5, 0, -0.5], [-0.5, 0, -0.5]])

    def is_beside(points):
        """Where the two coincide, either of them is the hit."""
        return (np.abs(points[..., [0, 2]]) > 0.51).any(axis=-1)

    check_lamp(found, epsilon, corners, is_beside, turn * np.sign(np.linalg.det(turn)))


@renderer_case("lamp that touches its receiver", USUAL)
def lamp_at_the_floor(found, epsilon):
    """The lamp stands on the floor: they share an edge, and |x − y|² goes to 0 there.

    1/|x − y|² grows without a bound, so that single samples become very bright; |x − y| = 0 is 0/0. The edge itself,
    where the radiance jumps, is left out.
    """
    corners = np.array([[0, 0, 1], [0, 0, -1], [0, 1, -1], [0, 1, 1]])  # a vertical square at x = 0 that faces +x
    check_lamp(found, epsilon, corners, lambda points: points[..., 0] != 0)


@renderer_case("lamp seen edge-on", USUAL)
def lamp_edge_on(found, epsilon):
    """The lamp hangs in a plane that contains points of the floor, and the eye looks along it, too.

    From these points, the lamp is a line: cos θ_y = 0, and the density is infinite. A sample of it is 0 · ∞ = NaN.
    """
    corners = np.array([[0, 0.5, 1], [0, 0.5, -1], [0, 1.5, -1], [0, 1.5, 1]])  # faces +x
    check_lamp(found, epsilon, corners, lambda points: np.isfinite(points[..., 0]))


@renderer_case("emissive degenerate triangles", USUAL)
def degenerate_lamps(found, epsilon):
    """Emissive triangles without area, with NaN and with infinity beside one that is right.

    In a cumulative distribution of areas, one NaN makes every entry after it NaN, so that the search always ends at the
    same lamp. A triangle without area that is chosen has the density 0/0. Only the right triangle must be a lamp,
    whichever choice is made, and the floor is lit by it alone.
    """
    corners = np.array([[-0.5, 1, -0.5], [0.5, 1, -0.5], [0.5, 1, 0.5]])  # faces down
    point, line = np.zeros((3, 3)), np.outer([0.0, 1, 2], [1, 1, 1])
    broken = [point, line, np.full((3, 3), np.nan), corners * [1, np.inf, 1], line + [3, 0, 0]]
    vertices = np.concatenate([*broken[:3], corners, *broken[3:]])
    lamps = vertices, np.arange(len(vertices)).reshape(-1, 3)
    good = 2 + 3  # the triangle's number: two of the floor, and three broken ones, come before it
    truth = reflected(floor_points(9, 1.0), corners)
    for choice in PARTS.names("lamp choice"):
        scene = scene_without_warnings(mesh_of([square(2), lamps], [FLOOR, lamp()]), lamp_choice=choice)
        renderer = path_renderer(scene, from_above(9, 1.0), sampler="independent")
        image, deviation, nan = rendered(renderer, "explicit", 256)
        found.add(np.abs(image[..., 0] - truth) > DEVIATIONS * deviation[..., 0] + 64 * epsilon, nan)
        found.add(list(scene.lamps.table.ids) != [good])


@renderer_case("total emissive area 0", USUAL)
def no_lamp_at_all(found, epsilon):
    """Every surface that emits has the area 0: there is a Ke > 0, and no light.

    The total area of the lamps is 0. Dividing by it, or searching in an empty table, is NaN or a crash. The picture
    must be black, in every way.
    """
    line = np.outer([0.0, 1, 2], [1.0, 1, 1]), np.array([[0, 1, 2]])
    scene = scene_without_warnings(mesh_of([square(2), line], [FLOOR, lamp()]))
    renderer = A4Renderer(scene, camera=Camera(8, 8, eye=(0, 3, 0.1), at=(0, 0, 0)))
    for way in WAYS:
        image, _, nan = rendered(renderer, way, 4)
        found.add((image != 0).any(axis=2), nan)


@renderer_case("Ke of 1e30 and 1e-30", USUAL)
def extreme_radiance(found, epsilon):
    """Lamps with Ke = 1e30 and 1e-30.

    In f32, the square of 1e30 is infinite and that of 1e-30 is 0: a sum of squares, a heuristic of radiances, or a
    power that is not scaled, is lost. Divided by Ke, both pictures and their errors must be the same, and the mean that
    of Lambert's formula.
    """
    spp, corners = 64, np.array([[-1.0, 1, -1], [1, 1, -1], [1, 1, 1], [-1, 1, 1]])
    truth = reflected(floor_points(9, 1.0), corners)
    pictures, errors = [], []
    for radiance in (1e30, 1e-30):
        scene = SceneData(mesh_of([square(2), quad(*corners)], [FLOOR, lamp(radiance)]))
        renderer = path_renderer(scene, from_above(9, 1.0))
        image, _, nan = rendered(renderer, "path", spp)
        pictures.append(image[..., 0] / radiance)
        errors.append(float(renderer.error()))
        found.add(np.zeros(truth.shape, bool), nan)
    one, other = pictures
    is_other_error = not abs(errors[0] / errors[1] - 1) <= spp * PIXEL  # one that is not known is wrong, too
    found.add(np.abs(one / other - 1) > spp * PIXEL, tried=0)
    found.add(np.array([abs(one.mean() / truth.mean() - 1) > 0.02, is_other_error]), tried=0)


@renderer_case("one lamp of 1e6 triangles", LARGE)
def million_triangle_lamp(found, epsilon):
    """A ball of 1e6 triangles that emits, above a floor.

    A cumulative distribution of 1e6 equal steps is at the limit of f32: its last steps are 1e-6, in units of 6e-8.
    Where the density of a lamp is not exactly the probability with which the search finds it, the picture is too dark.
    Straight below a ball of radius R at the height h, E = π L (R/h)², whichever choice is made.
    """
    radius, height = 0.5, 2.0
    ball = sphere(1000, 501, radius, (0, height, 0))
    truth = ALBEDO * (radius / height) ** 2
    for choice in PARTS.names("lamp choice"):
        scene = SceneData(mesh_of([square(2), ball], [FLOOR, lamp()]), lamp_choice=choice)
        renderer = path_renderer(scene, from_above(16, 0.01), sampler="independent", jitter=True)
        image, _, nan = rendered(renderer, "explicit", 256)
        error = image[..., 0].std() / np.sqrt(image[..., 0].size)
        # The ball is a polyhedron, which is smaller than the ball by some 1e-5.
        found.add(abs(image.mean() - truth) > 4 * error + 1e-4 * truth, nan, image[..., 0].size)
