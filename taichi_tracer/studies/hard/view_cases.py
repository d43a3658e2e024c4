"""Hard cases of where rays come from and where they go when nothing is hit, and of objects in several places."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import taichi as ti

from taichi_tracer.camera import Camera
from taichi_tracer.contracts.lab import WHOLE, Rows, sphere
from taichi_tracer.contracts.lights import Bench
from taichi_tracer.contracts.statistics import LAST
from taichi_tracer.environment import Environment
from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Instances, group
from taichi_tracer.lights.environment_light import EnvironmentLight
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.hard.case import (
    EVERYWHERE,
    LARGE,
    renderer_case,
    unit_rows,
)
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError

IMPOSSIBLE: tuple[tuple[str, dict], ...] = (  # (the parameter that is named, values)
    ("up", {"up": (0, 0, 1)}),
    ("up", {"up": (0, 0, -3)}),
    ("up", {"up": (0, 0, 0)}),
    ("up", {"up": (0, 1e-9, 1)}),
    ("eye", {"at": (0, 0, 5)}),
    ("eye", {"eye": (0, math.nan, 5)}),
    ("at", {"at": (math.inf, 0, 0)}),
    *(("fov", {"fov": fov}) for fov in (0, -10, 180, 200, math.nan, math.inf)),
    *(("width", {"width": size}) for size in (0, -1)),
    *(("height", {"height": size}) for size in (0, -7)),
)


@renderer_case("camera: impossible ones are refused", EVERYWHERE)
def impossible_cameras(found, epsilon):
    """Cameras for which no picture exists: they must be refused, with the name of the value.

    up parallel to the gaze, or eye = at, makes every ray NaN; a field of view of 180 degrees has a tangent that is
    negative in f32, and turns the picture over.

    Each raises an InputError that names the parameter.
    """
    for parameter, values in IMPOSSIBLE:
        try:
            Camera(**values)
            found.add(True)
        except InputError as error:
            found.add(parameter not in str(error))


@renderer_case("camera: 1×N, aspect 1e4, fov 0.01 and 179.9")
def extreme_cameras(found, epsilon):
    """Images of one row or column, an aspect of 1e4, fields of view of 0.01 and 179.9 degrees.

    width/height in integers is 0, tan(fov/2) is computed with an f32 of π, and at 0.01 degrees neighbouring pixels
    differ in the last digits only. Directions must be within a few ε of those in float64, or a thousandth of a pixel
    where a pixel is large.
    """
    view = np.array([1.0, 2, 3]), np.array([-4.0, 0.5, -1]), np.array([0.1, 1, 0])
    for width, height in ((1, 9), (9, 1), (10_000, 1), (31, 17)):
        x, y = np.meshgrid(np.arange(width), np.arange(height), indexing="ij")
        camera = Camera(width, height, *view)
        for fov in (0.01, 60.0, 179.9):
            camera.fov = fov
            directions = camera.rays(x.ravel(), y.ravel())[1].astype(np.float64).reshape(width, height, 3)
            first, middle, last = (true_directions(*view, fov, width, height, within) for within in (0, 0.5, 1))
            finite = np.isfinite(directions).all(axis=2)
            allowed = 8 * epsilon + 1e-3 * np.linalg.norm(last - first, axis=2)
            off = np.abs(directions - middle).max(axis=2) > allowed
            found.add(off & finite, int((~finite).sum()))


def true_directions(eye, at, up, fov: float, width: int, height: int, within: float) -> np.ndarray:
    """(width, height, 3) directions through a point of every pixel by A1-4 to A1-8 in float64."""
    z = (at - eye) / np.linalg.norm(at - eye)
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    tangent = math.tan(math.radians(fov) / 2)
    across = (2 * (np.arange(width) + within) / width - 1) * tangent * width / height
    upwards = (2 * (np.arange(height) + within) / height - 1) * tangent
    d = across[:, None, None] * x + upwards[None, :, None] * y + z
    return d / np.linalg.norm(d, axis=2, keepdims=True)


def lit_by(environment: Environment) -> Bench:
    """The light of an environment, to be asked."""
    return Bench(EnvironmentLight(environment, SimpleNamespace(environment="image")))


def axes_and_seam() -> np.ndarray:
    """(n, 3) directions along the axes and the seam, and some at random, in the running precision."""
    dtype = runtime.dtype()
    one, tiny = dtype(1), 4 * np.finfo(dtype).tiny  # one rounding below it is no denormal number
    axes = [
        np.insert(np.array(zeros, dtype), k, s * one)
        for k in range(3)
        for s in (1, -1)
        for zeros in itertools.product((0.0, -0.0, tiny, -tiny), repeat=2)
    ]
    axes = np.array(axes, dtype)
    up, down = np.nextafter(axes, dtype(2)), np.nextafter(axes, dtype(-2))
    rng = np.random.default_rng(7)
    spread = unit_rows(rng.normal(size=(2000, 3)))
    near_seam = np.array(
        [[-1, s * 10.0**-k, z * 10.0**-j] for k in range(9) for j in range(9) for s in (1, -1) for z in (1, -1)]
    )
    return np.concatenate([axes, up, down, spread, unit_rows(near_seam)]).astype(dtype)


@renderer_case("environment: axes, seam and poles", EVERYWHERE)
def environment_directions(found, epsilon):
    """The six axes with both zeros, and one rounding around the seam and the poles.

    (−1, 0, +0) gives u = 1, which is the texel after the last; asin of 1.0000001, a unit vector to rounding, is NaN.
    u and v must be in [0, 1], and those of float64 but for rounding; the texel exists, and has light.
    """
    width, height = 64, 32
    environment = Environment(np.random.default_rng(8).uniform(0.1, 1, (height, width, 3)))

    @ti.func
    def look(direction):
        u, v = environment.coords(direction)
        row, column = environment.texel_of(u, v)
        return u, v, row, column

    d = axes_and_seam().astype(np.float64)
    u, v, row, column = places = Rows(look, (3,), (1, 1, WHOLE, WHOLE))(d)
    pdf, radiance = lit_by(environment).values((0, 0, 0), d)
    true_u = (0.5 + np.arctan2(d[:, 2], d[:, 0]) / (2 * np.pi)) % 1.0
    true_v = 0.5 + np.arcsin(np.clip(d[:, 1], -1, 1)) / np.pi
    apart = np.abs(u - true_u)
    at_pole = np.hypot(d[:, 0], d[:, 2]) == 0
    u_off = (np.minimum(apart, 1 - apart) > 8 * epsilon) & ~at_pole
    # asin is steep at the poles: there an ε of y is a square root of ε of the angle.
    v_off = np.abs(v - true_v) > 2 * math.sqrt(epsilon)
    outside = (u < 0) | (u > 1) | (v < 0) | (v > 1)
    outside |= (row < 0) | (row >= height) | (column < 0) | (column >= width)
    dark = ~(pdf > 0) | ~(radiance > 0).all(axis=1)
    found.add(u_off | v_off | outside | dark, int(np.isnan([*places, pdf, *radiance.T]).any(axis=0).sum()))


def pictures_with_extremes() -> list[tuple[np.ndarray, float]]:
    """Pictures, and the brightest texel of each."""
    sun = np.full((64, 128, 3), 0.01)
    sun[17, 93] = 1e6
    rows = np.full((16, 32, 3), 0.5)
    rows[::2] = 0
    rows[-3:] = 0
    corner = np.zeros((8, 16, 3))
    corner[0, 0] = corner[-1, -1] = 3
    return [(sun, 1e6), (rows, 0.5), (corner, 3.0), (np.zeros((4, 8, 3)), 0.0)]


@renderer_case("environment: one-pixel sun, black rows, all black")
def environment_light_of_extremes(found, epsilon):
    """A sun of one pixel and 1e6, black rows, and pictures that are black all over.

    A cumulative sum in f32 loses the dark texels beside the sun, or the sun behind the many; a black row is 0/0; a
    black picture has no distribution at all. ξ = 0 and the last ξ before 1 must not fall off the ends. Every sample has
    unit length and a density; it finds light; light over density is the same everywhere.
    """
    edge = (0.0, 2.0**-24, 0.5, LAST)
    rng = np.random.default_rng(9)
    xi = np.concatenate([list(itertools.product(edge, edge)), rng.uniform(0, LAST, (4000, 2))]).astype(np.float32)
    for picture, brightest in pictures_with_extremes():
        d, _, colour, pdf = lit_by(Environment(picture)).sample((0, 0, 0), xi)
        radiance = colour[:, 0]
        length = np.abs(np.linalg.norm(d, axis=1) - 1) > 8 * epsilon
        nan = np.isnan(d).any(axis=1) | np.isnan(pdf) | np.isnan(radiance)
        found.add(length | ~(pdf > 0), int(nan.sum()))
        # A sample on a texel's border may be looked up in the next one.
        unlit = (radiance <= 0) if brightest > 0 else (np.abs(pdf * 4 * np.pi - 1) > 1e-5)
        found.add(unlit.mean() > 0.005, tried=0)
        if brightest > 0:
            total = np.median(radiance / pdf)
            edges = np.cos(np.pi * np.arange(len(picture) + 1) / len(picture))
            area = (edges[:-1] - edges[1:]) * 2 * np.pi / picture.shape[1]
            truth = (picture[..., 0] * area[:, None]).sum()
            found.add(abs(total / truth - 1) > 1e-4, tried=0)


# ── objects that stand in several places: every size and shear, none at all, and a million of them ──


TETRAHEDRON = np.array([(1.0, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
SIDES = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)], np.int32)  # fronts outside
RAYS = 2_000  # of each place


def shared(ball: Mesh, linear: np.ndarray, where: np.ndarray) -> SceneData:
    """The scene of an object that stands in several places and is in memory once.

    Args:
        linear: (n, 3, 3), or one for all. where: (n, 3).
    """
    transforms = np.tile(np.eye(4), (len(where), 1, 1))
    transforms[:, :3, :3], transforms[:, :3, 3] = linear, where
    return SceneData(group([Instances(ball, transforms)]), instances="shared")


@renderer_case("places: 1e-3 to 1e3 times as large, sheared, mirrored, 1e4 away")
def many_sizes(found, epsilon):
    """A closed sphere in places where it is a thousandth or a thousand times as large, sheared, mirrored, far away.

    A ray that is transformed into the object is rounded there. Where an object is small and far from the origin, the
    rounding is larger than its triangles: the ray passes between them, or by the boxes in which they lie. From the
    middle of each place, every corner and everything between must be hit, and normals have length 1.
    """
    shears = 0.0, 4.0
    vertices, faces = sphere(24, 13)
    rng = np.random.default_rng(4)
    turns, _ = np.linalg.qr(rng.normal(size=(2, 3, 3)))  # one of them mirrors, or both
    turns[1] *= -np.sign(np.linalg.det(turns[0])) * np.sign(np.linalg.det(turns[1]))
    ball = Mesh(vertices, faces)
    for scale in (1e-3, 1.0, 1e3):
        linear, where = [], []
        for shear, distance in itertools.product(shears, (0.0, 1e2, 1e4)):
            step = 9 * scale * (1 + max(shears)) * (len(where) - 6)
            linear += list(scale * turns @ np.array([(1, shear, 0), (0, 1, shear), (0, 0, 1)]))
            where += [(distance, -distance / 3, step), (-distance, 0, step + 9 * scale * (1 + shear))]
        scene = shared(ball, np.array(linear), np.array(where))
        for number, (matrix, place) in enumerate(zip(linear, where, strict=True)):
            origin = np.float32(place).astype(float)
            if 1e3 * epsilon * np.abs(origin).max() < np.linalg.svd(matrix)[1].min():  # else it may lie outside
                targets = vertices[rng.integers(0, len(vertices), RAYS)]
                targets[::2] = rng.normal(size=targets[::2].shape)
                hits = scene.intersect(np.tile(origin, (RAYS, 1)), targets @ matrix.T)
                lengths = np.linalg.norm(hits.normal.astype(np.float64), axis=1)
                is_own = hits.triangle_id // len(faces) == number
                found.add(~is_own | (np.abs(lengths - 1) > 1e-5), int(np.isnan(hits.distance).sum()))


@renderer_case("places: scaled to 0, to 1e-30, into a plane")
def scaled_to_nothing(found, epsilon):
    """Places whose transform is 0, almost 0, or presses everything into a plane: they have no inverse.

    Its numbers are infinite or NaN, and a NaN in one box makes every box above it NaN: then the whole scene disappears.
    What has an area must be hit, also a plane; nothing else; the neighbours are there.
    """
    flat = np.diag([1.0, 1.0, 0.0])
    linear = np.array([np.zeros((3, 3)), 1e-30 * np.eye(3), flat, np.eye(3), np.diag([1e-20, 1, 1])])
    where = np.array([(10.0 * k, 0, 0) for k in range(len(linear))])
    scene = shared(Mesh(*sphere(24, 13)), linear, where)
    hits = scene.intersect(where + (0.1, 0.2, 5), np.tile((0.0, 0, -1), (len(where), 1)))
    expected = np.array([False, False, True, True, False])
    found.add(hits.is_hit != expected, int(np.isnan(hits.position).sum()))
    found.add(np.abs(hits.distance[2] - 5) > 1e-5)


@renderer_case("places: 19,683, each hit")
def some_places(found, epsilon, side=27):
    """Twenty thousand tetrahedra side by side, and a ray at each: which primitive of all is it, and where?

    A number of a primitive that is counted through all places is large, and a hierarchy over places is deep. The id
    must be that of the side of the tetrahedron, and the distance that from the origin of the ray.
    """
    gap = 4.0
    cells = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    where = gap * (cells - side // 2)
    scene = shared(Mesh(TETRAHEDRON, SIDES), np.eye(3), where)
    rng = np.random.default_rng(6)
    face, inner = rng.integers(0, 4, len(where)), rng.dirichlet((2, 2, 2), len(where))
    target = where + np.einsum("nk,nkj->nj", inner, TETRAHEDRON[SIDES[face]])
    outwards = TETRAHEDRON[SIDES[face]].sum(axis=1) / 3
    hits = scene.intersect(target + outwards, -outwards)
    off = np.abs(hits.distance - 1) > 64 * epsilon * gap * side
    found.add((hits.triangle_id != 4 * np.arange(len(where)) + face) | off, int(np.isnan(hits.distance).sum()))


@renderer_case("places: 1,000,000, each hit", LARGE)
def million_places(found, epsilon):
    """A million tetrahedra, and a ray at each: tables of places and their hierarchy are as large as those of a mesh."""
    some_places(found, epsilon, side=100)
