"""Hard cases of light.

Rooms without a way out, lamps where formulas are 0/0, lamps without a size; BRDFs, normals, the film's sums, and
energy; microfacets, textures without an extent, lights inside surfaces.
"""

import copy
import itertools
import math
from collections.abc import Callable

import numpy as np
import taichi as ti

from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.brdfs.microfacet import LAYERED
from taichi_tracer.brdfs.rough_layer import LAYER_F0, LEAST
from taichi_tracer.camera import Camera
from taichi_tracer.cameras.orthographic import OrthographicCamera
from taichi_tracer.contracts.brdfs import Bench
from taichi_tracer.contracts.lab import separate, sphere
from taichi_tracer.contracts.statistics import LAST
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import group
from taichi_tracer.integrators.path_settings import MOST_BOUNCES
from taichi_tracer.lights.delta_lights import PointLight, SpotLight
from taichi_tracer.materials import Material, Texture
from taichi_tracer.options import brdfs_of
from taichi_tracer.picture.film import Film
from taichi_tracer.renderer import A2Renderer, A4Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import scene_from_mesh
from taichi_tracer.studies.hard import oracle
from taichi_tracer.studies.hard.case import (
    EVERYWHERE,
    LARGE,
    USUAL,
    box,
    join,
    renderer_case,
)
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import PARTS

# ── light that bounces ──


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
    return group([Mesh(*part, materials=[material]) for part, material in zip(parts, materials, strict=True)])


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
        scene = SceneData(mesh_of([square(2), lamps], [FLOOR, lamp()]), lamp_choice=choice)
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
    scene = SceneData(mesh_of([square(2), line], [FLOOR, lamp()]))
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


# ── BRDFs, normals, sums and energy ──


LENGTH_ERROR = 16  # ε: what the length of a direction, or the weight of a white surface, may be off by
MOST_ENERGY = 1.01  # of what a white surface receives: as much may be reflected, and the rounding of many sums is less
OF_BRDFS = "Ns 0 to 1e21, grazing, below the horizon, ξ = 0 and 1 − 2⁻²⁴"
HEIGHTS = (1.0, 0.5, 1e-3, 1e-6, 0.0, -1e-6, -0.5, -1.0)  # cosines of views
XIS = (0.0, 2.0**-24, 0.25, 0.5, LAST)


def benches_of(materials: list[Material]) -> list[Bench]:
    """A bench for each BRDF of the package, with the materials that it gets in a scene."""
    own = [brdf for brdf in brdfs_of(()) if PARTS.comes_with_package(brdf)]
    # Of several that describe a material, the last one gets it.
    chosen = [next(b for b in reversed(own) if b.describes(m, runtime.dtype())) for m in materials]
    of_brdf = {brdf: [m for m, one in zip(materials, chosen, strict=True) if one is brdf] for brdf in chosen}
    return [Bench(brdf, described) for brdf, described in of_brdf.items()]


def answers_of(bench: Bench, heights, xis) -> np.ndarray:
    """(materials, heights, ξ, ξ, 10) what a BRDF says of every combination of them.

    These are: w_i, its weight; and eval and pdf there, towards n, and opposite to n. n is +z.

    Args:
        heights: cosines of w_o. xis: random numbers, for both dimensions.
    """
    number, cosine, a, b = np.meshgrid(np.arange(len(bench.materials)), heights, xis, xis, indexing="ij")
    sine, n = np.sqrt(1 - cosine**2), np.array([0.0, 0, 1])
    which, w_o = number.ravel(), np.stack([sine * 0.6, sine * 0.8, cosine], axis=-1)
    w_i = bench.sample(which, w_o, n, np.stack([a, b], axis=-1))
    weight = bench.values(which, w_o, n, w_i)[2][:, 0]
    values = [number for to in (w_i, n, -n) for number in bench.values(which, w_o, n, to)[:2]]
    columns = [w_i, weight, *(value if value.ndim == 1 else value[:, 0] for value in values)]
    return np.column_stack(columns).reshape(*number.shape, 10)


def check_answers(found, epsilon, benches: list[Bench], most_weight: float = 1.0) -> None:
    """Whether answers are numbers, w_i has unit length, weights are in [0, most], and densities are at least 0.

    Args:
        most_weight: of a white surface: 1 where directions are drawn in proportion to the BRDF.
    """
    values = np.concatenate([answers_of(bench, HEIGHTS, XIS).reshape(-1, 10) for bench in benches])
    length = np.abs(np.linalg.norm(values[:, :3], axis=1) - 1) > LENGTH_ERROR * epsilon
    weight = (values[:, 3] < 0) | (values[:, 3] > most_weight * (1 + LENGTH_ERROR * epsilon))
    negative = (values[:, 4:] < 0).any(axis=1)
    nan = ~np.isfinite(values).all(axis=1)
    found.add((length | weight | negative) & ~nan, int(nan.sum()))


def check_energy(found, benches: list[Bench], heights) -> None:
    """Whether white surfaces reflect at most ``MOST_ENERGY`` of what they receive, four deviations granted."""
    grid = (np.arange(64) + 0.5) / 64  # ξ, in both dimensions
    for bench in benches:
        weights = answers_of(bench, heights, grid)[..., 3]
        mean, deviation = weights.mean(axis=(2, 3)), weights.std(axis=(2, 3)) / len(grid)
        found.add(mean > MOST_ENERGY + 4 * deviation, int((~np.isfinite(weights)).sum()))


def white_surfaces() -> list[Material]:
    """White materials, one for each exponent."""
    exponents = (0.0, 0.5, 1.0, 1.0 + 2.0**-20, 2.0, 50.0, 1e3, 1e6, 1e9, 1e13, 1e14, 1e16, 1e21)
    return [Material(Kd=(1.0, 1.0, 1.0), Ns=exponent) for exponent in exponents]


@renderer_case(f"BRDFs: {OF_BRDFS}", EVERYWHERE)
def brdfs_of_the_package(found, epsilon):
    """Exponents from 0 to 1e21, views along the surface and from below, ξ = 0 and the last before 1.

    cos^α of a negative cosine is NaN; with α = 1e21 the lobe over its density is 0/0 or ∞/∞; ln 0 is infinite; a vector
    with |z| a rounding above 1 has the square root of a negative number for its sine.
    """
    check_answers(found, epsilon, benches_of(white_surfaces()))


def own_brdf(brdf: Brdf, found, epsilon) -> None:
    """A BRDF that somebody registered, with the materials that it describes, or with all where it describes none.

    0/0 where the lobe and its density underflow together, the root of a negative number along the surface, a frame
    about a fixed axis: pictures show these as dots that come and go. A white surface that reflects more than it
    receives makes energy out of nothing. Single weights may be large: directions need not be drawn in proportion to
    the BRDF.
    """
    every, alone = white_surfaces(), copy.copy(brdf)
    materials = [m for m in every if brdf.describes(m, runtime.dtype())] or every
    alone.describes = lambda material, dtype: True
    bench = Bench(alone, materials)
    check_answers(found, epsilon, [bench], math.inf)
    check_energy(found, [bench], (1.0, 0.5, 0.05))


@renderer_case("opposite vertex normals")
def opposite_normals(found, epsilon):
    """A triangle whose vertex normals cancel on the way from one corner to another.

    0/|0| is NaN, in the middle of an edge only: a black or white dot that moves with the camera. Along the edge
    between the two, every normal must have unit length.
    """
    mesh = Mesh(
        vertices=np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]),
        faces=np.array([[0, 1, 2]]),
        normals=np.array([[1.0, 0, 0], [-1, 0, 0], [0, 0, 0]]),
        face_normals=np.array([[0, 1, 2]], np.int32),
    )
    scene = SceneData(mesh, intersector="brute_force")
    x = np.arange(1, 64) / 64
    hits = scene.intersect(np.stack([x, 0 * x, 0 * x + 1], axis=1), [0, 0, -1.0])
    length = np.linalg.norm(hits.normal.astype(np.float64), axis=1)
    found.add(~hits.is_hit | (np.abs(length - 1) > 8 * epsilon), int(np.isnan(length).sum()))


@ti.kernel
def expose(film: ti.template(), value: float, samples: ti.i32):
    """Add so many samples of the same value to every pixel of a film of one row."""
    for x in range(film.width):
        for k in range(samples):
            film.add(x, 0, tm.vec3(value, value / 3, value * 1000), k)


@renderer_case("accumulation of 1e7 samples")
def accumulation(found, epsilon):
    """The mean of 1e7 samples of the same value.

    A plain f32 sum is off by 1 % at 1e6 samples, and a sum of ones stands still at 2²⁴. What is lost in each addition
    has to be kept. The mean must be the value, within two roundings.
    """
    film, samples = Film(1, 1), 10_000_000
    value = float(runtime.dtype()(0.1))
    expose(film, value, samples)
    film.show()
    mean = film.canvas.to_numpy().astype(np.float64)[0, 0]
    off = np.abs(mean / (np.array([1, 1 / 3, 1000]) * value) - 1)
    found.add(~(off <= 2 * epsilon), tried=samples)
    found.add(film.counts().max() != samples, tried=0)


def furnace(estimator: str, found, epsilon) -> None:
    """White spheres, matte, glossy and mirror, in an even white light: nothing may be brighter than the light.

    A density in the wrong measure, a lobe that is not normalised, a weight that does not cancel: each makes energy out
    of nothing, which a picture with shadows hides. Every path is followed to its end, without Russian roulette. The
    mean radiance of each sphere must be at most 1.01, four deviations granted, and all samples finite.
    """
    exponents = (1.0, 20.0, 1e21)
    spheres = [sphere(10, 6, 1.0, (2.5 * k, 0, 0)) for k in range(len(exponents))]
    mesh = mesh_of(spheres, [Material(name=f"Ns{e:g}", Kd=(1.0, 1.0, 1.0), Ns=e) for e in exponents])
    scene = SceneData(mesh, intersector="brute_force", environment=np.ones((1, 1, 3)))
    view = {"eye": (2.5, 0, 60.0), "at": (2.5, 0, 0), "up": (0, 1, 0), "fov": 2.4}
    image, deviations, nan = rendered(A2Renderer(scene, camera=Camera(96, 32, **view)), estimator, 64)
    for third in np.split(np.arange(96), 3):
        deviation = np.linalg.norm(deviations[:, third]) / deviations[:, third].size
        is_dark_enough = image[:, third].mean() <= MOST_ENERGY + 4 * deviation
        found.add(not is_dark_enough, tried=image[:, third, 0].size * 64)
    found.add(False, nan, tried=0)


# ── microfacets, textures, lights inside surfaces ──


ALPHAS = (1e-6, 6e-5, 1e-4, 1e-3, 0.03, 0.3, 1.0)
TO_GRAZING = (1.0, 0.5, 0.05, 1e-3, 1e-6)  # cosines of views


def metals(**values) -> list[Material]:
    """White materials with every pair of roughnesses."""
    pairs = itertools.product(ALPHAS, ALPHAS)
    return [Material(**{"Kd": (1.0,) * 3, "F0": 1.0, "alpha_x": x, "alpha_y": y} | values) for x, y in pairs]


@renderer_case("microfacets: α 1e-6 to 1, views down to 1e-6 rad")
def microfacets(found, epsilon):
    """Metals with α from 1e-6 to 1, different along x and y, down to 1e-6 rad above the surface and from below it.

    D is 1/(π α⁴) beside a peak that is α wide, and G is 0/0 along the surface. The two must cancel on paper: as
    quotients of rounded numbers, they are infinite, NaN, or make energy out of nothing.
    """
    benches = benches_of(metals())
    check_answers(found, epsilon, benches)
    check_energy(found, benches, TO_GRAZING)


@renderer_case("rough layers: α 1e-6 to 1, views down to 1e-6 rad")
def rough_layers(found, epsilon):
    """A white base under such a layer, as in glTF files: a sample goes to one of them, and both reflect.

    If the two densities are not mixed as the samples are, or if the base gets light that the layer has reflected, a
    white surface reflects more than it receives, at grazing angles first. The weight of a sample of the mixture is at
    most that of a part, divided by the probability of this part.
    """
    layers = benches_of(metals(F0=(LAYER_F0,) * 3, extra={LAYERED: (1.0,)}))  # with the reflectance of glass
    check_answers(found, epsilon, layers, most_weight=1 / LEAST)
    check_energy(found, layers, TO_GRAZING)


@renderer_case("texture coordinates: equal, far away, NaN")
def degenerate_coordinates(found, epsilon):
    """Texture coordinates that are all equal, that are farther away than f32 counts texels, or that are no numbers.

    A triangle whose corners have one coordinate has no extent in the picture: what divides by it is 0/0. ⌊1e30⌋ as a
    whole number is anything, and the texel with this number lies outside the memory of the picture. Each must show a
    colour of the picture, of which the light is a multiple; NaN is refused, with the name uv.
    """
    places = (0.0, 0.25, 1.0, -7.5, 1e7, -1e30, 3e38)
    half = len(places)
    strips = [quad((x, 0, half), (x + 2, 0, half), (x + 2, 0, -half), (x, 0, -half)) for x in range(-half, half, 2)]
    vertices, faces = join(strips)
    uv = np.repeat(places, 6)[:, None] * np.ones(2)  # of the six corners of each strip
    pixels = np.random.default_rng(3).random((3, 5, 3))
    material = Material(Kd=(1.0,) * 3, map_Kd=Texture(pixels))
    scene = scene_from_mesh(vertices, faces, uv=uv, material=material, environment=np.ones((1, 1, 3)))
    renderer = A2Renderer(scene, camera=from_above(5 * half, half), jitter=False)
    image, _, nan = rendered(renderer, "brdf", 1)
    color = renderer.aov("albedo")
    found.add((color < pixels.min() - epsilon) | (color > pixels.max() + epsilon), nan)
    found.add(np.abs(image - color) > 8 * max(epsilon, PIXEL), tried=0)
    for value in (np.nan, np.inf):
        try:
            scene_from_mesh(vertices, faces, uv=np.full((len(vertices), 2), value))
            found.add(True)
        except InputError as error:
            found.add("uv" not in str(error))


@renderer_case("a light inside a surface")
def light_inside(found, epsilon):
    """A point that shines from inside a closed sphere, and points that lie in the plane of a floor.

    A shadow ray that starts a little behind its surface, or that passes between two triangles, lets the light out. The
    way to a light at the point that it lights has the length 0: 0/0 is its direction, and 1/0 its radiance. From
    outside, all must be black; inside, light arrives everywhere; in the plane of the floor, all is finite.
    """
    ball = sphere(24, 12, 0.5, (0.1, 0.7, -0.1))
    mesh = mesh_of([square(2), ball], [FLOOR, FLOOR])
    scene = SceneData(mesh, lights=[PointLight((0.15, 0.75, -0.05))])
    outside, inside = from_above(33, 2.0, 4), Camera(24, 24, eye=(0.1, 0.7, -0.5), at=(0.1, 0.7, 0), fov=80)
    for camera, is_lit in ((outside, False), (inside, True)):
        image, _, nan = rendered(path_renderer(scene, camera), "explicit", 1)
        found.add((image > 0).any(axis=2) != is_lit, nan)
    lights = [PointLight(place) for place in ((0.0, 0, 0), (2.0, 0, 2), (0.5, 1e-30, 0.25))]
    scene = SceneData(mesh_of([square(2)], [FLOOR]), lights=lights)
    image, _, nan = rendered(path_renderer(scene, outside), "explicit", 1)
    found.add((image < 0).any(axis=2), nan)


@renderer_case("spots of zero angle, and without a soft edge")
def spot_angles(found, epsilon):
    """Spots in one place whose two angles are equal: 0, 30, 90 and 180 degrees.

    Between the two angles, the light falls linearly: (cutoff − θ)/(cutoff − falloff) is 0/0 if they are equal. The
    angle to the axis is an acos of a number that may be a rounding above 1, which is NaN in the middle of the light.
    The floor must show the sum of s(θ) I cos θ/r² of all, each of them black beyond its cutoff.
    """
    size, half, height = 33, 2.0, 1.0
    near = 1e-3  # degrees to the border of the light, where rounding decides
    lines, cones = ((0.0, 0.0), (1e-30, 0.0)), ((30.0, 30.0), (90.0, 90.0), (180.0, 180.0), (60.0, 0.0))
    points = floor_points(size, half)
    r = np.sqrt((points**2).sum(axis=2) + height**2)
    theta = np.degrees(np.arctan2(np.linalg.norm(points, axis=2), height))
    for angles in (lines, cones):  # apart, because the border of a line is the middle of a cone
        strengths = [(2.0**-k, *pair) for k, pair in enumerate(angles)]  # so that two errors do not cancel
        spots = [SpotLight((0, height, 0), (0, 0, 0), *values) for values in strengths]
        scene = SceneData(mesh_of([square(half)], [FLOOR]), lights=spots)
        image, _, nan = rendered(path_renderer(scene, from_above(size, half, 0.5)), "explicit", 1)
        sure, truth = np.ones(theta.shape, bool), np.zeros(theta.shape)
        for intensity, cutoff, falloff in strengths:
            share = np.clip((cutoff - theta) / max(cutoff - falloff, 1e-300), 0, 1)
            truth += ALBEDO / np.pi * intensity * share * height / r**3
            sure &= np.abs(theta - cutoff) > near
        found.add(sure & ~(np.abs(image[..., 0] - truth) <= 1e-5), nan)
