"""An environment as a light: samples follow the density, which is positive and integrates to one."""

from types import SimpleNamespace

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import light as oracle
from probe import put, vec3
from support import start

from taichi_tracer.environment import Environment, load_environment
from taichi_tracer.lights.environment_light import EnvironmentLight, find, mean_of_bilinear, sampling_tables
from taichi_tracer.ray import Ray, no_hit
from taichi_tracer.system import runtime

pytestmark = pytest.mark.usefixtures("f32")


def light_of(environment, kind="image"):
    """The light of an environment, ready to be sampled."""
    light = EnvironmentLight(environment, SimpleNamespace(environment=kind))
    light.prepare()
    return light


@ti.kernel
def _ask(light: ti.template(), d: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2)):
    for i in range(d.shape[0]):
        ray = Ray(origin=tm.vec3(1, 2, 3), direction=vec3(d, i, 0))
        out[i, 0] = light.pdf(ray.origin, ray.direction, no_hit())
        put(out, i, 1, light.radiance(ray, no_hit()))


def asked(light, directions):
    """(N,) pdf, and (N, 3) radiance."""
    d = np.ascontiguousarray(directions, runtime.dtype())
    out = np.zeros((len(d), 4), runtime.dtype())
    _ask(light, d, out)
    return out[:, 0], out[:, 1:]


@ti.kernel
def _sample(light: ti.template(), xi: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2)):
    for i in range(xi.shape[0]):
        w, distance, value, pdf = light.sample(tm.vec3(1, 2, 3), tm.vec2(xi[i, 0], xi[i, 1]))
        put(out, i, 0, w)
        put(out, i, 3, value)
        out[i, 6], out[i, 7] = pdf, distance


def samples_of(light, count=1_000_000):
    """(count, 3) directions, (count, 3) radiance, (count,) pdf, (count,) distance."""
    xi = np.random.default_rng(5).random((count, 2)).astype(runtime.dtype())
    out = np.zeros((count, 8), runtime.dtype())
    _sample(light, xi, out)
    out = out.astype(np.float64)
    return out[:, :3], out[:, 3:6], out[:, 6], out[:, 7]


def random_image(rng, h=16, w=32):
    return rng.lognormal(sigma=2, size=(h, w, 3)).astype(np.float32)


def cell_probability(light, fine=12):
    """(24, 48) by y and azimuth: the density, integrated over a fine grid of directions."""
    y = -1 + 2 * (np.arange(24 * fine * 4) + 0.5) / (24 * fine * 4)
    phi = -np.pi + 2 * np.pi * (np.arange(48 * fine * 2) + 0.5) / (48 * fine * 2)
    yy, pp = np.meshgrid(y, phi, indexing="ij")
    r = np.sqrt(1 - yy**2)
    d = np.stack([r * np.cos(pp), yy, r * np.sin(pp)], -1).reshape(-1, 3)
    density = asked(light, d)[0].astype(np.float64).reshape(24, fine * 4, 48, fine * 2)
    probability = density.mean(axis=(1, 3)) * 4 * np.pi / (24 * 48)
    pixels = light.environment.pixels
    if pixels.max() > 1e4 * pixels.mean():  # a sun is smaller than the grid: by its texels
        probability = probability_by_texel(light)
    return probability / probability.sum()


def probability_by_texel(light):
    """As ``cell_probability``, from the texels' own probabilities, each cut into fine × fine equal parts."""
    h, w = light.environment.height, light.environment.width
    fine = max(6, 2400 // h)
    rows, columns = light.row_cdf.to_numpy()[0].astype(float), light.column_cdf.to_numpy().astype(float)
    p = np.diff(rows)[:, None] * np.diff(columns, axis=1) / fine**2
    edges = np.cos(np.pi * np.arange(h + 1) / h)
    part = (np.arange(fine) + 0.5) / fine
    y = (edges[:-1, None] + part * np.diff(edges)[:, None]).reshape(-1)
    phi = 2 * np.pi * ((np.arange(w)[:, None] + part) / w - 0.5).reshape(-1)
    yy, pp = np.meshgrid(y, phi, indexing="ij")
    weights = np.repeat(np.repeat(p, fine, axis=0), fine, axis=1)
    return np.histogram2d(
        yy.ravel(), pp.ravel(), bins=(24, 48), range=((-1, 1), (-np.pi, np.pi)), weights=weights.ravel()
    )[0]


def test_the_search_finds_the_interval_of_each_number(rng):
    """At and beside every edge of the distributions, of which some intervals have the width 0, and in between."""
    image = random_image(rng)
    image[3:6] = 0
    image[:, 4:9] = 0
    image[7, 11] = 1e7
    light = light_of(Environment(image))
    (rows,), columns = light.row_cdf.to_numpy(), light.column_cdf.to_numpy()
    for row, cdf in ((-1, rows), (0, columns[0]), (7, columns[7])):
        edges = np.concatenate(
            [cdf, np.nextafter(cdf, 0), np.nextafter(cdf, 1), np.arange(len(cdf) - 1) / (len(cdf) - 1)]
        )
        xi = np.concatenate([edges, rng.random(2000)]).astype(np.float32)
        xi = xi[(xi >= 0) & (xi < 1)]
        found = np.zeros(len(xi), np.int32)
        _find(light, row, xi, found)
        np.testing.assert_array_equal(found, np.searchsorted(cdf, xi, side="right") - 1)


@ti.kernel
def _find(light: ti.template(), row: int, xi: ti.types.ndarray(), found: ti.types.ndarray()):
    for i in range(xi.shape[0]):
        index = 0
        if row < 0:
            index, _ = find(light.row_cdf, light.row_guide, 0, light.environment.height, xi[i])
        else:
            index, _ = find(light.column_cdf, light.column_guide, row, light.environment.width, xi[i])
        found[i] = index


def test_the_density_integrates_to_one(precision, rng):
    """z < 4.5 (p = 7e-6)."""
    start(precision)
    for lookup in ("nearest", "bilinear"):
        light = light_of(Environment(random_image(rng), lookup=lookup))
        d = oracle.to_unit(rng.normal(size=(400_000, 3)))
        pdf = asked(light, d)[0].astype(np.float64) * 4 * np.pi
        assert abs(pdf.mean() - 1) < 4.5 * pdf.std() / np.sqrt(len(pdf))
    start("f32")


def test_the_density_is_positive_everywhere_near_axes_and_seams():
    image = np.arange(8, dtype=np.float32)[:, None, None] * 100 + np.arange(16)[None, :, None] + np.ones(3)
    axes = [[s if k == axis else z for k in range(3)] for axis in range(3) for s in (1.0, -1.0) for z in (0.0, -0.0)]
    near_seam = [[-1, 0, z] for z in (1e-7, -1e-7, 1e-30, -1e-30)] + [[1e-8, y, 1e-8] for y in (1, -1)]
    for lookup in ("nearest", "bilinear"):
        pdf, _ = asked(light_of(Environment(image, lookup=lookup)), np.array(axes + near_seam))
        assert (pdf > 0).all()


def test_a_turned_environment_is_sampled_where_it_is_bright(rng):
    light = light_of(Environment(random_image(rng), rotation=90))
    w, radiance, pdf, _ = samples_of(light, 10_000)
    told, seen = asked(light, w)
    assert np.isclose(told, pdf, rtol=1e-5).mean() > 0.995
    assert np.isclose(seen, radiance, rtol=1e-5).all(axis=1).mean() > 0.995


@pytest.mark.parametrize("lookup", ["nearest", "bilinear"])
def test_samples_tell_the_power_of_the_whole(rng, lookup):
    """The mean of radiance / pdf is ∫ L dω, with a small variance: what such sampling is for; z < 4.5 (p = 7e-6)."""
    image = random_image(rng)
    light = light_of(Environment(image, lookup=lookup))
    _, radiance, pdf, _ = samples_of(light, 100_000)
    edges = np.cos(np.pi * np.arange(17) / 16)
    solid_angle = (edges[:-1] - edges[1:]) * 2 * np.pi / 32
    estimates = radiance / pdf[:, None]
    if lookup == "nearest":
        exact = (image.astype(float) * solid_angle[:, None, None]).sum(axis=(0, 1))
        z = (estimates.mean(axis=0) - exact) / (estimates.std(axis=0) / np.sqrt(len(pdf)))
        assert np.abs(z).max() < 4.5
    luminance = estimates @ [0.2126, 0.7152, 0.0722]
    assert luminance.std() < (0.01 if lookup == "nearest" else 0.6) * luminance.mean()


# ── what is compiled ──


@pytest.mark.parametrize(("kind", "expected"), [("image", 3.0), ("constant", 3.0), ("black", 0.0), ("none", 0.0)])
def test_what_a_ray_sees_is_what_the_effects_call_for(kind, expected):
    environment = Environment(np.full((2, 4, 3), 2.0), intensity=1.5)
    _, seen = asked(light_of(environment, kind), [[0.6, 0, 0.8], [0, -1, 0]])
    np.testing.assert_array_equal(seen, np.full((2, 3), expected))


def test_with_z_up_the_zenith_is_above(rng):
    """The light of (x, −z, y) with z up is that of (x, y, z) with y up, and so are samples and densities."""
    environment = load_environment("sunny", rotation=30.0)
    upright, lying = (EnvironmentLight(environment, SimpleNamespace(environment="image"), axis) for axis in "yz")
    upright.prepare()
    lying.prepare()
    d = rng.normal(size=(200, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    for one, other in zip(asked(upright, d), asked(lying, d[:, [0, 2, 1]] * [1, -1, 1]), strict=True):
        np.testing.assert_array_equal(one, other)
    xi = np.ascontiguousarray(rng.random((200, 2)), runtime.dtype())
    drawn = []
    for light in (upright, lying):
        drawn.append(np.zeros((200, 8), runtime.dtype()))
        _sample(light, xi, drawn[-1])
    np.testing.assert_array_equal(drawn[1][:, :3], drawn[0][:, [0, 2, 1]] * np.float32([1, -1, 1]))
    np.testing.assert_array_equal(drawn[1][:, 3:], drawn[0][:, 3:])


# ── the tables ──


def test_tables_are_the_cumulative_power_of_rows_and_texels(rng):
    """Luminance × solid angle, by hand."""
    image = random_image(rng, 4, 8).astype(np.float64)
    rows, columns, density = sampling_tables(image, "nearest", np.float64)
    edges = np.cos(np.pi * np.arange(5) / 4)
    solid_angle = (edges[:-1] - edges[1:]) * 2 * np.pi / 8
    power = (image @ [0.2126, 0.7152, 0.0722]) * solid_angle[:, None]
    np.testing.assert_allclose(np.diff(rows), power.sum(axis=1) / power.sum(), rtol=1e-12)
    np.testing.assert_allclose(np.diff(columns, axis=1), power / power.sum(axis=1, keepdims=True), rtol=1e-9)
    np.testing.assert_allclose(density, power / power.sum() / solid_angle[:, None], rtol=1e-9)
    assert rows[-1] == 1
    assert (columns[:, -1] == 1).all()


def test_what_is_almost_even_is_sampled_as_a_whole(rng):
    """Above its mean is only noise of the texels, of which a picture would sample nothing else."""
    image = np.ones((8, 16, 3)) + 1e-4 * rng.random((8, 16, 1))
    whole = sampling_tables(image, "nearest", np.float64)
    for one, other in zip(sampling_tables(image, "nearest", np.float64, compensates=True), whole, strict=True):
        np.testing.assert_array_equal(one, other)


def test_compensated_tables_are_those_of_the_light_above_its_mean(rng):
    """max(0, luminance − mean) × solid angle, by hand; the mean is that over the sphere."""
    image = random_image(rng, 4, 8).astype(np.float64)
    image[1, 2] = 50
    rows, columns, density = sampling_tables(image, "nearest", np.float64, compensates=True)
    edges = np.cos(np.pi * np.arange(5) / 4)
    solid_angle = np.repeat((edges[:-1] - edges[1:])[:, None] * 2 * np.pi / 8, 8, axis=1)
    brightness = image @ [0.2126, 0.7152, 0.0722]
    power = np.maximum(brightness - (brightness * solid_angle).sum() / (4 * np.pi), 0) * solid_angle
    np.testing.assert_allclose(np.diff(rows), power.sum(axis=1) / power.sum(), rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(density, power / power.sum() / solid_angle, rtol=1e-9, atol=1e-15)
    assert ((density > 0) == (power > 0)).all()
    assert (power == 0).sum() > 8
    assert (columns[:, -1] == 1).all()


def test_a_colour_without_luminance_is_sampled():
    """Outside the gamut, where a component is negative, a thousandth of the largest one is its share."""
    texels = np.array([[[1.0, 1.0, 1.0], [1000.0, -1000 * 0.2126 / 0.7152, 0.0]]])
    rows, columns, _ = sampling_tables(texels, "nearest", np.float64)
    np.testing.assert_allclose(np.diff(columns[0]), [0.5, 0.5])
    _, _, density = sampling_tables(np.zeros((2, 4, 3)), "nearest", np.float64)
    np.testing.assert_allclose(density, 1 / (4 * np.pi))  # a black image is sampled uniformly


def test_the_mean_of_a_bilinear_look_up_is_that_of_many_points(rng):
    texels = rng.random((3, 5))
    fine = 200
    down, across = ((np.arange(count * fine) + 0.5) / fine - 0.5 for count in (3, 5))
    v, u = np.meshgrid(down, across, indexing="ij")
    row, column = np.floor(v).astype(int), np.floor(u).astype(int)
    fv, fu = v - row, u - column
    rows = np.clip(row, 0, 2), np.clip(row + 1, 0, 2)
    columns = column % 5, (column + 1) % 5
    value = (1 - fv) * ((1 - fu) * texels[rows[0], columns[0]] + fu * texels[rows[0], columns[1]])
    value += fv * ((1 - fu) * texels[rows[1], columns[0]] + fu * texels[rows[1], columns[1]])
    expected = value.reshape(3, fine, 5, fine).mean(axis=(1, 3))
    np.testing.assert_allclose(mean_of_bilinear(texels), expected, atol=1e-5)
