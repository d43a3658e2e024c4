"""Hard cases of where rays come from and where they go when nothing is hit: camera and environment."""

import itertools
import math

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.camera import Camera
from taichi_tracer.environment import Environment
from taichi_tracer.lights import environment_light
from taichi_tracer.ray import no_hit
from taichi_tracer.studies.hard.case import LAST_XI, RendererCase
from taichi_tracer.studies.hard.meshes import unit_rows
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError


class ImpossibleCameras(RendererCase):
    """Cameras for which no picture exists: they must be refused, with the name of the value.

    up parallel to the gaze, or eye = at, makes every ray NaN; a field of view of 180 degrees has a tangent that is
    negative in f32, and turns the picture over.
    """

    name = "camera: impossible ones are refused"
    impossible = (
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

    def check(self, found, epsilon):
        """Each raises an InputError that names the parameter."""
        for parameter, values in self.impossible:
            try:
                Camera(**values)
                found.add(True)
            except InputError as error:
                found.add(parameter not in str(error))


class ExtremeCameras(RendererCase):
    """Images of one row or column, an aspect of 1e4, fields of view of 0.01 and 179.9 degrees.

    width/height in integers is 0, tan(fov/2) is computed with an f32 of π, and at 0.01 degrees neighbouring pixels
    differ in the last digits only.
    """

    name = "camera: 1×N, aspect 1e4, fov 0.01 and 179.9"
    sizes = ((1, 9), (9, 1), (10_000, 1), (31, 17))
    fovs = (0.01, 60.0, 179.9)
    eye, at, up = np.array([1.0, 2, 3]), np.array([-4.0, 0.5, -1]), np.array([0.1, 1, 0])

    def check(self, found, epsilon):
        """Directions within a few ε of those in float64, or a thousandth of a pixel where a pixel is large."""
        for width, height in self.sizes:
            x, y = np.meshgrid(np.arange(width), np.arange(height), indexing="ij")
            camera = Camera(width, height, self.eye, self.at, self.up)
            for fov in self.fovs:
                camera.fov = fov
                directions = camera.rays(x.ravel(), y.ravel())[1].astype(np.float64).reshape(width, height, 3)
                first, middle, last = (self.truth(width, height, fov, within) for within in (0, 0.5, 1))
                finite = np.isfinite(directions).all(axis=2)
                off = np.abs(directions - middle).max(axis=2) > 8 * epsilon + 1e-3 * np.linalg.norm(
                    last - first, axis=2
                )
                found.add(off & finite, int((~finite).sum()))

    def truth(self, width: int, height: int, fov: float, within: float) -> np.ndarray:
        """(width, height, 3) directions through a point of every pixel by A1-4 to A1-8 in float64."""
        z = (self.at - self.eye) / np.linalg.norm(self.at - self.eye)
        x = np.cross(self.up, z)
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

    @ti.kernel
    def look(self, directions: ti.types.ndarray(ndim=2), found: ti.types.ndarray(ndim=2)):
        """Columns: u, v, row, column, pdf, radiance."""
        for i in range(directions.shape[0]):
            d = tm.vec3(directions[i, 0], directions[i, 1], directions[i, 2])
            u, v = self.environment.coords(d)
            row, column = self.environment.texel_of(u, v)
            found[i, 0], found[i, 1], found[i, 2], found[i, 3] = u, v, row, column
            found[i, 4], found[i, 5] = self.light.pdf(tm.vec3(0), d, no_hit()), self.environment.radiance(d).x

    @ti.kernel
    def draw(self, xi: ti.types.ndarray(ndim=2), found: ti.types.ndarray(ndim=2)):
        """Columns: direction, pdf, radiance from there."""
        for i in range(xi.shape[0]):
            d, pdf = self.light.sample_direction(tm.vec2(xi[i, 0], xi[i, 1]))
            found[i, 0], found[i, 1], found[i, 2], found[i, 3] = d.x, d.y, d.z, pdf
            found[i, 4] = self.environment.radiance(d).x


class EnvironmentDirections(RendererCase):
    """The six axes with both zeros, and one rounding around the seam and the poles.

    (−1, 0, +0) gives u = 1, which is the texel after the last; asin of 1.0000001, a unit vector to rounding, is NaN.
    """

    name = "environment: axes, seam and poles"
    width, height = 64, 32

    def directions(self) -> np.ndarray:
        """(n, 3) directions in the running precision."""
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

    def check(self, found, epsilon):
        """u and v in [0, 1], those of float64 but for rounding, a texel that exists, and light in it."""
        rng = np.random.default_rng(8)
        lookups = _Lookups(Environment(rng.uniform(0.1, 1, (self.height, self.width, 3))))
        directions = self.directions()
        answers = np.empty((len(directions), 6), runtime.dtype())
        lookups.look(directions, answers)
        u, v, row, column, pdf, radiance = answers.astype(np.float64).T
        d = directions.astype(np.float64)
        true_u = (0.5 + np.arctan2(d[:, 2], d[:, 0]) / (2 * np.pi)) % 1.0
        true_v = 0.5 + np.arcsin(np.clip(d[:, 1], -1, 1)) / np.pi
        apart = np.abs(u - true_u)
        at_pole = np.hypot(d[:, 0], d[:, 2]) == 0
        u_off = (np.minimum(apart, 1 - apart) > 8 * epsilon) & ~at_pole
        # asin is steep at the poles: there an ε of y is a square root of ε of the angle.
        v_off = np.abs(v - true_v) > 2 * math.sqrt(epsilon)
        outside = (u < 0) | (u > 1) | (v < 0) | (v > 1)
        outside |= (row < 0) | (row >= self.height) | (column < 0) | (column >= self.width)
        dark = ~(pdf > 0) | ~(radiance > 0)
        found.add(u_off | v_off | outside | dark, int(np.isnan(answers).any(axis=1).sum()))


class EnvironmentLight(RendererCase):
    """A sun of one pixel and 1e6, black rows, and pictures that are black all over.

    A cumulative sum in f32 loses the dark texels beside the sun, or the sun behind the many; a black row is 0/0; a
    black picture has no distribution at all. ξ = 0 and the last ξ before 1 must not fall off the ends.
    """

    name = "environment: one-pixel sun, black rows, all black"

    def pictures(self) -> list[tuple[np.ndarray, float]]:
        """Pictures, and the brightest texel of each."""
        sun = np.full((64, 128, 3), 0.01)
        sun[17, 93] = 1e6
        rows = np.full((16, 32, 3), 0.5)
        rows[::2] = 0
        rows[-3:] = 0
        corner = np.zeros((8, 16, 3))
        corner[0, 0] = corner[-1, -1] = 3
        return [(sun, 1e6), (rows, 0.5), (corner, 3.0), (np.zeros((4, 8, 3)), 0.0)]

    def check(self, found, epsilon):
        """Every sample has unit length and a density; it finds light; light over density is the same everywhere."""
        edge = (0.0, 2.0**-24, 0.5, LAST_XI)
        rng = np.random.default_rng(9)
        xi = np.concatenate([list(itertools.product(edge, edge)), rng.uniform(0, LAST_XI, (4000, 2))]).astype(
            np.float32
        )
        for picture, brightest in self.pictures():
            lookups = _Lookups(Environment(picture))
            answers = np.empty((len(xi), 5), runtime.dtype())
            lookups.draw(xi.astype(runtime.dtype()), answers)
            d, pdf, radiance = answers[:, :3].astype(np.float64), answers[:, 3].astype(np.float64), answers[:, 4]
            length = np.abs(np.linalg.norm(d, axis=1) - 1) > 8 * epsilon
            found.add(length | ~(pdf > 0), int(np.isnan(answers).any(axis=1).sum()))
            # A sample on a texel's border may be looked up in the next one.
            unlit = (radiance <= 0) if brightest > 0 else (np.abs(pdf * 4 * np.pi - 1) > 1e-5)
            found.add(unlit.mean() > 0.005, tried=0)
            if brightest > 0:
                total = np.median(radiance / pdf)
                edges = np.cos(np.pi * np.arange(len(picture) + 1) / len(picture))
                area = (edges[:-1] - edges[1:]) * 2 * np.pi / picture.shape[1]
                truth = (picture[..., 0] * area[:, None]).sum()
                found.add(abs(total / truth - 1) > 1e-4, tried=0)
