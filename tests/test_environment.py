"""Directions to texels, texels to directions, and the density of both."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import light
from scipy import stats
from support import start

import taichi_tracer as tt
from taichi_tracer.environment import Environment, load_environment
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.system import runtime

NAMES = list(shipped_environments())


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


@ti.kernel
def _radiance(environment: ti.template(), d: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2)):
    for i in range(d.shape[0]):
        value = environment.radiance(tm.vec3(d[i, 0], d[i, 1], d[i, 2]))
        for k in ti.static(range(3)):
            out[i, k] = value[k]
        out[i, 3] = environment.pdf(tm.vec3(d[i, 0], d[i, 1], d[i, 2]))


@ti.kernel
def _sample(environment: ti.template(), xi: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2)):
    for i in range(xi.shape[0]):
        w, pdf = environment.sample(tm.vec2(xi[i, 0], xi[i, 1]))
        for k in ti.static(range(3)):
            out[i, k] = w[k]
        out[i, 3] = pdf


def ask(environment, directions):
    """(N, 3) radiance and (N,) pdf."""
    d = np.ascontiguousarray(directions, runtime.dtype())
    out = np.zeros((len(d), 4), runtime.dtype())
    _radiance(environment, d, out)
    return out[:, :3], out[:, 3]


def samples_of(environment, count=1_000_000):
    xi = np.random.default_rng(5).random((count, 2)).astype(runtime.dtype())
    out = np.zeros((count, 4), runtime.dtype())
    _sample(environment, xi, out)
    return out[:, :3].astype(np.float64), out[:, 3].astype(np.float64)


def random_image(rng, h=16, w=32):
    return rng.lognormal(sigma=2, size=(h, w, 3)).astype(np.float32)


def test_nearest_texel_is_that_of_the_formula(precision, rng):
    """A2-5 with C-1, but where the coordinate is within rounding of a texel's edge."""
    image = random_image(rng)
    directions = light.to_unit(rng.normal(size=(50_000, 3))).astype(runtime.dtype())
    found, _ = ask(Environment(image), directions)
    expected = light.lookup(image, directions)
    assert (found == expected).all(axis=1).mean() > (0.9995 if precision == "f32" else 0.99999)


def test_axes_and_signed_zeros_stay_inside_the_image():
    start("f32")
    image = np.arange(8, dtype=np.float32)[:, None, None] * 100 + np.arange(16)[None, :, None] + np.zeros(3)
    axes = [[s if k == axis else z for k in range(3)] for axis in range(3) for s in (1.0, -1.0) for z in (0.0, -0.0)]
    near_seam = [[-1, 0, z] for z in (1e-7, -1e-7, 1e-30, -1e-30)] + [[1e-8, y, 1e-8] for y in (1, -1)]
    for lookup in ("nearest", "bilinear"):
        radiance, pdf = ask(Environment(image, lookup=lookup), np.array(axes + near_seam))
        assert np.isfinite(radiance).all()
        assert (pdf > 0).all()
        assert radiance.min() >= 0
        assert radiance.max() <= image.max()
    radiance, _ = ask(Environment(image), [[0, 1, 0], [0, -1, 0], [1, 0.01, 0.01], [-1, 0.01, -1e-3]])
    assert radiance[0, 0] // 100 == 0  # the top row is up
    assert radiance[1, 0] // 100 == 7
    assert radiance[2, 0] % 100 == 8
    assert radiance[3, 0] % 100 == 0


def test_bilinear_meets_the_texels_at_their_centres_and_wraps(rng):
    image = random_image(rng, 4, 8)
    u, v = np.meshgrid((np.arange(8) + 0.5) / 8, 1 - (np.arange(4) + 0.5) / 4)
    azimuth, elevation = 2 * np.pi * (u - 0.5), np.pi * (v - 0.5)
    centres = np.stack(
        [np.cos(elevation) * np.cos(azimuth), np.sin(elevation), np.cos(elevation) * np.sin(azimuth)], -1
    )
    radiance, _ = ask(Environment(image, lookup="bilinear"), centres.reshape(-1, 3))
    np.testing.assert_allclose(radiance, image.reshape(-1, 3), rtol=1e-3)
    seam, _ = ask(Environment(image, lookup="bilinear"), [[-np.cos(elevation[1, 0]), np.sin(elevation[1, 0]), 0]])
    np.testing.assert_allclose(seam[0], (image[1, 0] + image[1, -1]) / 2, rtol=1e-3)


def test_intensity_and_rotation(rng):
    image = random_image(rng)
    d = light.to_unit(rng.normal(size=(5_000, 3)))
    plain, turned = Environment(image, intensity=2.5), Environment(image, rotation=90)
    np.testing.assert_allclose(ask(plain, d)[0], 2.5 * ask(Environment(image), d)[0], rtol=1e-6)
    back = np.stack([d[:, 2], d[:, 1], -d[:, 0]], axis=1)  # a quarter turn of azimuth less
    same = (ask(turned, d)[0] == ask(Environment(image), back)[0]).all(axis=1)
    assert same.mean() > 0.999
    w, pdf = samples_of(turned, 10_000)
    near = np.isclose(ask(turned, w)[1], pdf, rtol=1e-5)
    assert near.mean() > 0.995
    version = plain.version
    plain.set_intensity(0)
    assert plain.version == version + 1
    assert not ask(plain, d)[0].any()


@pytest.mark.parametrize("lookup", ["nearest", "bilinear"])
@pytest.mark.parametrize("name", [*NAMES, "black rows"])
def test_samples_follow_the_density(name, lookup, rng):
    """χ² of 1e6 samples over cells of known probability; the pdf told is that of ``pdf``; p > 1e-4."""
    environment = made(name, lookup)
    w, told = samples_of(environment)
    assert np.isfinite(w).all()
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1, atol=1e-6)
    _, pdf = ask(environment, w)
    assert np.isclose(pdf, told, rtol=1e-5).mean() > 0.99  # the others lie within rounding of a texel's edge
    probability = cell_probability(environment)
    counts, _, _ = np.histogram2d(
        w[:, 1], np.arctan2(w[:, 2], w[:, 0]), bins=(24, 48), range=((-1, 1), (-np.pi, np.pi))
    )
    expected = probability * len(w)
    rare = expected < 10
    observed = np.append(counts[~rare], counts[rare].sum())
    expected = np.append(expected[~rare], max(expected[rare].sum(), 1e-9))
    keep = expected > 5
    assert observed[~keep].sum() <= 40
    assert stats.chisquare(observed[keep], expected[keep] * observed[keep].sum() / expected[keep].sum()).pvalue > 1e-4


def made(name, lookup):
    if name != "black rows":
        return load_environment(name, lookup=lookup)
    image = np.ones((16, 32, 3))
    image[3:12] = 0
    return Environment(image, lookup=lookup)


def test_one_bright_pixel_takes_all_samples_evenly():
    """A sun of 10⁶ in an otherwise black sky: uniform in azimuth and in y over its texel; p > 1e-4."""
    start("f32")
    image = np.zeros((32, 64, 3))
    image[9, 63] = 1e6
    environment = Environment(image)
    w, pdf = samples_of(environment, 200_000)
    y_top, y_bottom = np.cos(np.pi * np.array([9, 10]) / 32)
    u = np.arctan2(w[:, 2], w[:, 0]) / (2 * np.pi) + 0.5
    assert stats.kstest((w[:, 1] - y_bottom) / (y_top - y_bottom), "uniform").pvalue > 1e-4
    assert stats.kstest(u * 64 - 63, "uniform").pvalue > 1e-4
    np.testing.assert_allclose(pdf, 64 / (2 * np.pi * (y_top - y_bottom)), rtol=1e-6)


def cell_probability(environment, fine=12):
    """(24, 48) by y and azimuth: the density, integrated over a fine grid of directions."""
    y = -1 + 2 * (np.arange(24 * fine * 4) + 0.5) / (24 * fine * 4)
    phi = -np.pi + 2 * np.pi * (np.arange(48 * fine * 2) + 0.5) / (48 * fine * 2)
    yy, pp = np.meshgrid(y, phi, indexing="ij")
    r = np.sqrt(1 - yy**2)
    d = np.stack([r * np.cos(pp), yy, r * np.sin(pp)], -1).reshape(-1, 3)
    density = ask(environment, d)[1].astype(np.float64).reshape(24, fine * 4, 48, fine * 2)
    probability = density.mean(axis=(1, 3)) * 4 * np.pi / (24 * 48)
    if environment.pixels.max() > 1e4 * environment.pixels.mean():  # a sun is smaller than the grid: by its texels
        probability = probability_by_texel(environment)
    return probability / probability.sum()


def probability_by_texel(environment):
    """As ``cell_probability``, from the texels' own probabilities, each cut into fine × fine equal parts."""
    h, w = environment.height, environment.width
    fine = max(6, 2400 // h)
    rows, columns = environment.row_cdf.to_numpy().astype(float), environment.column_cdf.to_numpy().astype(float)
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


def test_the_density_integrates_to_one(rng):
    for lookup in ("nearest", "bilinear"):
        environment = Environment(random_image(rng), lookup=lookup)
        d = light.to_unit(rng.normal(size=(400_000, 3)))
        pdf = ask(environment, d)[1].astype(np.float64) * 4 * np.pi
        assert abs(pdf.mean() - 1) < 4 * pdf.std() / np.sqrt(len(pdf))


def test_what_effects_are_derived_from():
    assert load_environment("white").constant == (1, 1, 1)
    assert load_environment("black").is_black
    assert load_environment("studio").constant is None
    assert load_environment(None) is None


@pytest.mark.parametrize(
    ("image", "message"),
    [
        ([[[1, np.nan, 0]]], "environment: radiance is not finite at row 0, column 0: nan (1 such texels)"),
        (np.full((2, 4, 3), -0.5), "radiance is negative at row 0, column 0: -0.5 (8 such texels)"),
        (np.full((1, 2, 3), 1e39), "is not finite at row 0, column 0: 1e+39"),
        (np.zeros((2, 4, 4)), "has the shape (height, width, 3), not (2, 4, 4)"),
        (np.zeros((0, 0, 3)), "has the shape (height, width, 3), not (0, 0, 3)"),
        ("studoi", "unknown environment 'studoi': did you mean 'studio'?"),
        ("nowhere/sky.hdr", "nowhere/sky.hdr: no such file"),
    ],
)
def test_what_is_no_radiance_is_refused_with_its_place(image, message):
    start("f32")
    with pytest.raises(tt.InputError) as error:
        load_environment(image)
    assert message in str(error.value)


def test_a_map_that_is_not_two_to_one_is_used_with_a_warning():
    with pytest.warns(UserWarning, match="3×3 is not twice as wide as high"):
        Environment(np.ones((3, 3, 3)))


@pytest.mark.parametrize("extension", [".npy", ".pfm", ".exr", ".hdr", ".png"])
def test_files_are_linear_radiance(extension, tmp_path, rng):
    if extension in (".exr", ".hdr"):
        pytest.importorskip("OpenImageIO")
    image = rng.uniform(0.1, 0.9, (4, 8, 3)).astype(np.float32) * (1 if extension == ".png" else 50)
    path = tmp_path / f"sky{extension}"
    tt.save_image(path, image, srgb=extension == ".png")
    environment = load_environment(path)
    tolerance = {".png": 0.01, ".hdr": 0.4}.get(extension, 1e-5)
    np.testing.assert_allclose(environment.pixels, image, atol=tolerance)
