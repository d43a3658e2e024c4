"""Surfaces that emit: samples against closed forms, densities against what rays hit, and which surfaces are lamps."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE, with_spheres

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh

SAMPLES = 20_000
LAMP, DARK = tt.Material("lamp", Kd=(0, 0, 0), Ke=(1, 1, 1)), tt.Material("dark")
# The square in the plane z = 0 faces +z. Points around it: near, far, at its edge, and some that it sees edge-on.
POINTS = np.array(
    [[x, y, z] for x, y in ((0, 0), (0.9, 0.2), (1.5, -1.2), (4, 0.5), (-7, 7)) for z in (0.1, 0.3, 1, 8)], float
)

pytestmark = pytest.mark.usefixtures("f32")


def square(**options):
    """A square lamp."""
    return tt.SceneData(Mesh(*SQUARE, materials=[LAMP]), **options)


@ti.data_oriented
class Probe:
    """Samples of the light of a scene, and what rays along them hit."""

    def __init__(self, scene):
        self.scene = scene
        self.lights = scene.in_kernels().lights
        self.lights.prepare()

    def samples(self, points, normals, seed=1):
        """(n, 9) per point and normal: w_i, distance, red light, pdf, pdf of what is hit, is blocked, light seen."""
        xi = np.random.default_rng(seed).random((len(points), 2)).astype(np.float32)
        out = np.zeros((len(points), 9), np.float32)
        self._run(np.float32(points), np.float32(normals), xi, out)
        return out

    @ti.kernel
    def _run(
        self,
        points: ti.types.ndarray(ndim=2),
        normals: ti.types.ndarray(ndim=2),
        xi: ti.types.ndarray(ndim=2),
        out: ti.types.ndarray(ndim=2),
    ):
        for i in range(points.shape[0]):
            x = tm.vec3(points[i, 0], points[i, 1], points[i, 2])
            n = tm.vec3(normals[i, 0], normals[i, 1], normals[i, 2])
            w_i, distance, light, pdf = self.lights.sample(x, n, tm.vec2(xi[i, 0], xi[i, 1]))
            ray = tt.Ray(origin=x, direction=w_i)
            hit = self.scene.ray_intersector.query_segment(ray, 0.0, tm.inf)
            for k in ti.static(range(3)):
                out[i, k] = w_i[k]
            out[i, 3], out[i, 4], out[i, 5] = distance, light.x, pdf
            out[i, 6] = self.lights.pdf(x, n, w_i, hit)
            out[i, 7] = self.scene.ray_intersector.is_occluded(ray, distance)
            out[i, 8] = self.lights.arriving(ray, hit).x


def irradiance(found, normals):
    """(mean, standard error) of light · cos / pdf over samples of one point."""
    w, light, pdf, blocked = found[:, :3], found[:, 4], found[:, 5], found[:, 7]
    values = np.where(blocked == 0, light * np.maximum(0, (w * normals).sum(axis=1)) / pdf, 0).astype(np.float64)
    return values.mean(), values.std() / np.sqrt(len(values))


def lamps_and_blockers(rng):
    """Lamps of all sizes and powers, some spheres among them, and dark triangles between them."""
    count = 60
    corners = rng.uniform(-3, 3, (count, 1, 3)) + rng.normal(size=(count, 3, 3)) * 10 ** rng.uniform(
        -2, 0, (count, 1, 1)
    )
    materials = [DARK] + [tt.Material(str(i), Ke=tuple(rng.random(3) * 10**i)) for i in range(-2, 3)]
    return with_spheres(
        np.concatenate([rng.uniform(-3, 3, (6, 3)), rng.uniform(0.05, 0.5, (6, 1))], axis=1),
        corners.reshape(-1, 3),
        np.arange(3 * count).reshape(-1, 3),
        face_materials=rng.integers(0, 6, count).astype(np.int32),
        sphere_materials=rng.integers(0, 6, 6).astype(np.int32),
        materials=materials,
    )


@pytest.mark.parametrize("choice", ["hierarchy"])
@pytest.mark.parametrize("two_sided", [False])
def test_the_density_of_a_sample_is_that_of_what_its_ray_hits(choice, two_sided, rng):
    """Also, nothing but another surface blocks a sample: no lamp blocks its own light."""
    scene = tt.SceneData(lamps_and_blockers(rng), lamp_choice=choice, two_sided_lamps=two_sided, environment="studio")
    points, normals = rng.uniform(-4, 4, (SAMPLES, 3)), rng.normal(size=(SAMPLES, 3))
    found = Probe(scene).samples(points, normals / np.linalg.norm(normals, axis=1, keepdims=True))
    is_seen = (found[:, 7] == 0) & (found[:, 4] > 0)
    assert 0.2 < is_seen.mean() < 0.97
    seen = found[is_seen]
    # The ray may pass between the moved end and the lamp's edge: then it sees something else.
    same = np.isclose(seen[:, 4], seen[:, 8], rtol=1e-4)
    assert same.mean() > 0.999
    is_steady = same & (seen[:, 5] < 1e6)  # beyond it, the lamp is seen so flat that its cosine is rounding
    off = np.abs(seen[is_steady, 6] / seen[is_steady, 5] - 1)
    assert np.quantile(off, 0.99) < 1e-3
    assert np.median(off) < 1e-5


def sky(scene, w):
    """The red radiance of a scene's environment along directions: the nearest texel."""
    image = scene.environment.pixels
    h, width = image.shape[:2]
    u, v = 0.5 + np.arctan2(w[:, 2], w[:, 0]) / (2 * np.pi), 0.5 + np.arcsin(np.clip(w[:, 1], -1, 1)) / np.pi
    column = np.minimum((u * width).astype(int), width - 1)
    row = np.minimum(((1 - v) * h).astype(int), h - 1)
    return image[row, column, 0].astype(float)


def test_what_cannot_be_hit_is_no_lamp():
    """Triangles without area, spheres without radius and materials that do not emit are never chosen."""
    corners = np.concatenate([SQUARE[0], [[5, 5, 5]]])
    faces = np.concatenate([SQUARE[1], [[4, 4, 4], [0, 0, 1]]])
    mesh = with_spheres([[0, 0, 3, -1], [0, 0, 5, 0.5]], corners, faces, materials=[LAMP, DARK])
    mesh.sphere_materials[:] = [0, 1]
    with pytest.warns(UserWarning, match="dropped"):
        scene = tt.SceneData(mesh)
    assert scene.lamps.count == 2
    assert sorted(scene.lamps.table.primitives) == [0, 1]


def test_an_unknown_choice_of_lamps_is_an_error():
    with pytest.raises(tt.InputError, match="lamp choice 'nearest'"):
        square(lamp_choice="nearest")


@pytest.mark.parametrize("estimator", ["environment", "mis"])
def test_a_sphere_lights_the_floor_below_it(estimator):
    """E = π L (R/d)² below its centre (PBR, 4th edition, 6.2.4); a matte floor reflects Kd E / π."""
    radius, height, Kd, Ke = 0.5, 2.0, 0.6, 3.0
    mesh = Mesh(
        vertices=np.array([[-4, 0, 4], [4, 0, 4], [4, 0, -4], [-4, 0, -4]], float),
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        face_materials=np.zeros(2, np.int32),
        materials=[tt.Material("floor", Kd=(Kd,) * 3), tt.Material("lamp", Kd=(0,) * 3, Ke=(Ke,) * 3)],
        spheres=np.array([[0, height, 0, radius]]),
        sphere_ids=np.array([2], np.int32),
        sphere_materials=np.array([1], np.int32),
    )
    scene = tt.SceneData(mesh, view={"eye": (0, 1, 3), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 0.1})
    image = tt.A3Renderer(scene, 4, 4).use(estimator).render(1024).image()
    assert image.mean() == pytest.approx(Kd * Ke * (radius / height) ** 2, rel=0.01)
