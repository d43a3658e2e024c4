"""Hard cases of where rays come from and where they go when nothing is hit: camera and environment."""

import itertools
import math

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.camera import Camera
from taichi_tracer.contracts.lab import WHOLE, Rows
from taichi_tracer.environment import Environment
from taichi_tracer.lights import environment_light
from taichi_tracer.ray import no_hit
from taichi_tracer.studies.hard.case import EVERYWHERE, LAST_XI, renderer_case, unit_rows
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


@ti.data_oriented
class _Lookups:
    """Radiance, texel and density of directions, and samples, of an environment."""

    def __init__(self, environment: Environment) -> None:
        self.environment = environment
        # Only its density and its samples are asked, which depend on no effect of a scene.
        self.light = environment_light.EnvironmentLight(environment, effects=None)
        self.light.prepare()

    @ti.func
    def look(self, d):
        """u, v, row, column, pdf, radiance."""
        u, v = self.environment.coords(d)
        row, column = self.environment.texel_of(u, v)
        return u, v, row, column, self.light.pdf(tm.vec3(0), d, no_hit()), self.environment.radiance(d).x

    @ti.func
    def draw(self, xi):
        """Direction, pdf, radiance from there."""
        d, pdf = self.light.sample_direction(xi)
        return d, pdf, self.environment.radiance(d).x


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
    lookups = _Lookups(Environment(np.random.default_rng(8).uniform(0.1, 1, (height, width, 3))))
    d = axes_and_seam().astype(np.float64)
    answers = Rows(lookups.look, (3,), (1, 1, WHOLE, WHOLE, 1, 1))(d)
    u, v, row, column, pdf, radiance = answers
    true_u = (0.5 + np.arctan2(d[:, 2], d[:, 0]) / (2 * np.pi)) % 1.0
    true_v = 0.5 + np.arcsin(np.clip(d[:, 1], -1, 1)) / np.pi
    apart = np.abs(u - true_u)
    at_pole = np.hypot(d[:, 0], d[:, 2]) == 0
    u_off = (np.minimum(apart, 1 - apart) > 8 * epsilon) & ~at_pole
    # asin is steep at the poles: there an ε of y is a square root of ε of the angle.
    v_off = np.abs(v - true_v) > 2 * math.sqrt(epsilon)
    outside = (u < 0) | (u > 1) | (v < 0) | (v > 1)
    outside |= (row < 0) | (row >= height) | (column < 0) | (column >= width)
    dark = ~(pdf > 0) | ~(radiance > 0)
    found.add(u_off | v_off | outside | dark, int(np.isnan(answers).any(axis=0).sum()))


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
    edge = (0.0, 2.0**-24, 0.5, LAST_XI)
    rng = np.random.default_rng(9)
    xi = np.concatenate([list(itertools.product(edge, edge)), rng.uniform(0, LAST_XI, (4000, 2))]).astype(np.float32)
    for picture, brightest in pictures_with_extremes():
        d, pdf, radiance = Rows(_Lookups(Environment(picture)).draw, (2,), (3, 1, 1))(xi)
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
