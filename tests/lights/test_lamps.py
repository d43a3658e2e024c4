"""Surfaces that emit: samples against closed forms, densities against what rays hit, and which surfaces are lamps."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles.lamps import clipped, polygon_irradiance, sphere_irradiance
from shapes import SQUARE, with_spheres
from support import long_except

import taichi_tracer as tt
from taichi_tracer.contracts.statistics import largest_z
from taichi_tracer.geometry import Mesh

SAMPLES = 20_000
CHOICES = ("area", "power", "hierarchy")
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


@pytest.mark.long
@pytest.mark.parametrize("choice", long_except(CHOICES, "hierarchy"))
def test_a_square_gives_lamberts_irradiance(choice):
    """20 points, with normals along the square and towards it: near, far and grazing. Significance 1 %."""
    probe = Probe(square(lamp_choice=choice))
    limit, corners = largest_z(2 * len(POINTS), 0.01), SQUARE[0]
    for point in POINTS:
        for normal in ([0, 0, -1], [1, 0, 0]):
            normal = np.array(normal, float)
            above = clipped(point, normal, corners)
            expected = polygon_irradiance(point, normal, above) if len(above) >= 3 else 0.0
            normals = np.tile(normal, (SAMPLES, 1))
            mean, error = irradiance(probe.samples(np.tile(point, (SAMPLES, 1)), normals), normals)
            assert abs(mean - expected) <= limit * error + 1e-5 * expected, (point, normal, mean, expected, error)


@pytest.mark.long
def test_a_near_lamp_is_sampled_in_solid_angle():
    """Lambert's irradiance close to the lamp, where samples that are uniform in area differ by orders of magnitude."""
    normal, corners = np.array([0, 0, -1.0]), SQUARE[0]
    point = corners.mean(axis=0) + [0.1, 0.05, 0.05]
    expected = polygon_irradiance(point, normal, corners)
    normals, points, errors = np.tile(normal, (SAMPLES, 1)), np.tile(point, (SAMPLES, 1)), {}
    for choice in ("area", "power"):
        mean, errors[choice] = irradiance(Probe(square(lamp_choice=choice)).samples(points, normals), normals)
        assert abs(mean - expected) <= largest_z(2, 0.01) * errors[choice] + 1e-4 * expected
    assert errors["power"] < errors["area"] / 5


@pytest.mark.long
@pytest.mark.parametrize("distance", [1.001, 1.5, 30.0, 3000.0])
def test_a_sphere_gives_the_irradiance_of_its_cone(distance):
    scene = tt.SceneData(with_spheres([[0, 0, 0, 1]], materials=[LAMP]))
    point, normal = np.array([0, 0, distance]), np.array([0, 0, -1.0])
    normals = np.tile(normal, (SAMPLES, 1))
    mean, error = irradiance(Probe(scene).samples(np.tile(point, (SAMPLES, 1)), normals), normals)
    expected = sphere_irradiance(distance, 1.0)
    assert abs(mean - expected) <= largest_z(4, 0.01) * error + 1e-4 * expected
    assert error < 0.01 * expected


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


@pytest.mark.parametrize("choice", long_except(CHOICES, "hierarchy"))
@pytest.mark.parametrize("two_sided", long_except([False, True], False))
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


@pytest.mark.long
@pytest.mark.parametrize("choice", long_except(CHOICES, "hierarchy"))
def test_all_choices_and_the_mixture_give_the_same_irradiance(choice, rng):
    """Against a uniform sphere of directions, at five points among lamps, blockers and an environment; 1 %."""
    scene = tt.SceneData(lamps_and_blockers(rng), lamp_choice=choice, environment="studio")
    probe = Probe(scene)
    for k in range(5):
        point, normal = rng.uniform(-2, 2, 3), np.array([0, 1.0, 0])
        normals = np.tile(normal, (10 * SAMPLES, 1))
        found = probe.samples(np.tile(point, (10 * SAMPLES, 1)), normals, seed=k)
        mean, error = irradiance(found, normals)
        assert np.isfinite(error)
        expected, other = by_directions(scene, point, normal, rng)
        assert abs(mean - expected) < largest_z(5, 0.01) * np.hypot(error, other), k


def by_directions(scene, point, normal, rng, count=400_000):
    """(irradiance, standard error) by directions in proportion to the cosine, from Python alone."""
    xi = rng.random((count, 2))
    r, phi = np.sqrt(xi[:, 0]), 2 * np.pi * xi[:, 1]
    w = np.column_stack([r * np.cos(phi), np.sqrt(1 - xi[:, 0]), r * np.sin(phi)])  # around +y
    hits = scene.intersect(point, w)
    ke = np.array([m.Ke for m in scene.materials])[:, 0]
    light = np.where(hits.is_hit & ~hits.is_backfacing, ke[hits.material_id], 0.0)
    miss = ~hits.is_hit
    light[miss] = sky(scene, w[miss])
    return np.pi * light.mean(), np.pi * light.std() / np.sqrt(count)


def sky(scene, w):
    """The red radiance of a scene's environment along directions: the nearest texel."""
    image = scene.environment.pixels
    h, width = image.shape[:2]
    u, v = 0.5 + np.arctan2(w[:, 2], w[:, 0]) / (2 * np.pi), 0.5 + np.arcsin(np.clip(w[:, 1], -1, 1)) / np.pi
    column = np.minimum((u * width).astype(int), width - 1)
    row = np.minimum(((1 - v) * h).astype(int), h - 1)
    return image[row, column, 0].astype(float)


@pytest.mark.long
def test_a_triangle_emits_from_its_front_unless_both_sides_are_asked_for():
    behind, normal = np.array([[0.1, 0.2, -1.0]]), np.array([[0, 0, 1.0]])
    for two_sided, light in ((False, 0), (True, 1)):
        found = Probe(square(two_sided_lamps=two_sided)).samples(behind, normal)[0]
        assert found[4] == light
        assert found[8] == light


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


@pytest.mark.long
@pytest.mark.parametrize("power", [1e-30, 1e30])
def test_extreme_radiance_is_sampled(power):
    scene = tt.SceneData(Mesh(*SQUARE, materials=[tt.Material(Ke=(power,) * 3)]))
    normals = np.tile([0, 0, -1.0], (200, 1))
    found = Probe(scene).samples(np.tile([0.2, 0.1, 1.0], (200, 1)), normals)
    assert np.isfinite(found[:, :6]).all()
    np.testing.assert_allclose(found[:, 4], power, rtol=1e-6)


def test_the_number_and_the_choice_of_lamps_are_told():
    scene = square(lamp_choice="area")
    assert repr(scene.lamps) == "Lamps(2 surfaces, chosen by area)"
    with pytest.raises(tt.InputError, match="lamp choice 'nearest'"):
        square(lamp_choice="nearest")
