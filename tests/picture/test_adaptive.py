"""Adaptive sampling: unbiased, better where noise is uneven, and the same for every number of passes."""

import numpy as np
import pytest
import taichi as ti
from support import start

import taichi_tracer as tt
from taichi_tracer.forms import EyeRays
from taichi_tracer.picture import adaptive
from taichi_tracer.picture.adaptive import (
    LEAST_MEAN,
    POWER,
    SMALLEST,
    WHOLE,
    Shares,
    gain_of,
    shares_of,
    variance_of_groups,
)
from taichi_tracer.picture.progress import Target

SIZE, SPP = 32, 64


@pytest.fixture(scope="module")
def scene():
    start("f32")
    return tt.load_scene_data("specular_spheres", environment="studio")


def test_shares_follow_the_deviation_but_none_is_below_a_quarter_of_the_mean():
    rng = np.random.default_rng(3)
    deviation = np.kron(np.geomspace(0.001, 1, 16) * np.ones((16, 1)), np.ones((4, 4))) * rng.uniform(0.5, 1, (64, 64))
    shares = shares_of(deviation) / WHOLE
    assert shares.max() == 1
    assert shares.min() == pytest.approx(SMALLEST * shares.mean(), rel=0.01)
    columns = shares[32, 2::4]
    assert (np.diff(columns) >= 0).all()
    assert columns[12] / columns[11] == pytest.approx(1000 ** (2 * POWER / 15), rel=0.2)
    np.testing.assert_array_equal(shares_of(np.zeros((2, 2))), WHOLE)


def test_a_few_noisy_groups_do_not_make_all_others_wait():
    deviation = np.full((128, 128), 0.001)
    deviation[40:44, 60:64] = 1
    shares = shares_of(deviation) / WHOLE
    assert shares.mean() >= LEAST_MEAN
    assert shares[41, 61] == 1
    assert shares[41, 58] > 10 * shares.min()  # beside them, there may be noise, too


def test_the_pixels_of_a_group_have_one_share_that_of_the_mean_of_their_variances():
    """Groups begin at the bottom left; those at the upper and the right edge may have fewer pixels."""
    deviation = np.random.default_rng(2).uniform(1, 2, (10, 7))
    variance = variance_of_groups(deviation)
    assert variance[0, 0] == pytest.approx((deviation[6:10, 0:4] ** 2).mean())
    assert variance[2, 1] == pytest.approx((deviation[0:2, 4:7] ** 2).mean())
    shares = shares_of(deviation)
    assert shares.shape == deviation.shape
    for rows in (slice(0, 2), slice(2, 6), slice(6, 10)):
        for columns in (slice(0, 4), slice(4, 7)):
            assert np.ptp(shares[rows, columns]) == 0


def test_pixels_outside_a_crop_do_not_count(scene):
    deviation = np.random.default_rng(2).uniform(1, 2, (16, 16))
    own = np.zeros((16, 16), bool)
    own[4:12, 4:12] = True
    inside = shares_of(np.where(own, deviation, np.nan))
    assert inside[own].mean() == pytest.approx(inside.mean(), rel=1e-3)
    renderer = tt.A2Renderer(scene, SIZE, SIZE, adaptive=True, crop=(8, 20, 4, 30)).use("mis").render(24)
    counts = renderer.film.counts()[8:20, 4:30]
    assert counts.mean() == pytest.approx(renderer.samples, rel=0.1)
    assert counts.max() > counts.min() > 0


def test_a_pixel_takes_its_samples_one_after_the_other_at_any_pass(scene):
    """As ⌊pass · share / WHOLE⌋ says, beyond 2^32 / WHOLE passes, too; the first has the index ``begin``."""
    rng, shares = np.random.default_rng(1), Shares(4, 4, True, begin=7)
    shares.set(rng.integers(1, WHOLE + 1, (4, 4)).astype(np.int32))
    own = shares.to_image()[::-1].T
    for first in (0, WHOLE - 3, 2**20 - 5, 2**31):
        for index in range(first, first + 9):
            found = taken(shares, index)
            before, after = ((index + k) * own.astype(np.int64) // WHOLE for k in (0, 1))
            np.testing.assert_array_equal(found[..., 0].astype(np.uint32), 7 + before)
            np.testing.assert_array_equal(found[..., 1], after - before)
    assert shares.range_of(1, 2, 5, 2**31) == tuple(7 + (k * int(own[1, 2]) // WHOLE) for k in (5, 2**31))


def taken(shares, index):
    """(4, 4, 2): for each pixel the index of its sample in a pass, and whether it takes it."""
    found = np.zeros((4, 4, 2), np.int32)
    take(shares, index, found)
    return found


@ti.kernel
def take(shares: ti.template(), index: ti.u32, found: ti.types.ndarray(ti.i32, 3)):
    for x, y in ti.ndrange(4, 4):
        i, is_taken = shares.sample_of(x, y, index)
        found[x, y, 0], found[x, y, 1] = ti.cast(i, ti.i32), ti.cast(is_taken, ti.i32)


@pytest.mark.parametrize("fast", [True, False])
def test_passes_at_once_take_the_same_samples(scene, fast):
    """Beyond 2^31, too, where the number of a pass is no signed word."""
    images = []
    for passes in (1, 4, 8):
        renderer = tt.A2Renderer(scene, 8, 8, adaptive=True, fast=fast).use("brdf").render(1)
        renderer.shares.set(np.kron([[WHOLE, 5], [WHOLE // 7, WHOLE // 3]], np.ones((4, 4), int)).astype(np.int32))
        assert renderer.plan.passes_at_once == 2
        renderer.reset()
        for first in range(2**31 - 8, 2**31 + 8, passes):
            renderer.add_sample(first, passes)
        assert renderer.film.counts().max() == 16
        images.append(renderer.film.image())
    np.testing.assert_array_equal(images[0], images[1])
    np.testing.assert_array_equal(images[0], images[2])


def test_views_have_nothing_to_adapt_to(scene):
    with pytest.raises(tt.InputError, match="adaptive sampling needs random samples"):
        tt.A1Renderer(scene, 8, 8, adaptive=True)


# ── a picture that begins again by itself ──


@pytest.fixture(scope="module")
def box(scene):
    """The noise is at the edges of the lamp."""
    return tt.load_scene_data("cornell_box")


@pytest.fixture
def soon(monkeypatch):
    """Few samples are many."""
    monkeypatch.setattr(adaptive, "MUCH", 1)


def error(picture, deviation):
    """The error of a picture with so many samples per pixel, on average, if it falls as their root."""
    share = np.ones_like(deviation) if picture is None else picture
    return np.sqrt((deviation**2 / share).mean() * share.mean())


def test_the_gain_is_that_of_the_shares_and_chance_alone_gains_nothing():
    """The variance of a mean of one pixel is a square of a normal number times its true value."""
    rng, true = np.random.default_rng(4), np.kron(np.geomspace(0.05, 1, 64).reshape(8, 8), np.ones((8, 8)))
    found = [gain_of(true * abs(rng.normal(size=true.shape))) for _ in range(20)]
    wanted = (error(None, true) / error(shares_of(true) / WHOLE, true)) ** 2
    assert wanted > 1.5
    assert np.median(found) == pytest.approx(wanted, rel=0.2)
    even = [gain_of(abs(rng.normal(size=true.shape))) for _ in range(20)]
    assert max(even) < 1.1
    rare = [gain_of((rng.random(true.shape) < 0.002) * 1.0) for _ in range(20)]  # bright dots, anywhere
    assert np.median(rare) <= 1
    assert gain_of(np.zeros((9, 7))) == 0


def test_only_pixels_that_are_noisy_count(scene):
    """Where rays hit nothing, samples cost so little that it is no gain to take fewer; NaN is a pixel without any."""
    deviation = np.zeros((32, 32))
    deviation[8:24] = 1
    assert gain_of(deviation) == pytest.approx(1, abs=0.01)
    deviation[:8] = np.nan
    assert gain_of(deviation) == pytest.approx(1, abs=0.01)
    deviation[:] = 0.01
    deviation[10:14, 20:25] = 1
    assert gain_of(deviation) > 5
    assert gain_of(deviation[3:, 3:]) > 5  # whose last group has one pixel, and is in none of the two halves


def test_a_long_picture_of_uneven_noise_begins_again_with_shares(box, soon):
    """It has the samples of those indices, in each pixel as many as its share allows, and knows its error."""
    renderer = tt.A3Renderer(box, SIZE, SIZE).use("mis").render(error=0.03)
    assert renderer.own_shares.is_on
    assert renderer.error().high <= 0.03
    assert 0 < renderer.progress.pilot.samples <= 64
    assert "more samples where noise is larger" in "\n".join(renderer.receipt())
    counts = renderer.film.counts()
    assert renderer.film.samples >= counts.max() > 4 * counts.min() > 0
    assert renderer.samples == pytest.approx(counts.mean(), abs=2)
    y, x = 5, 20
    explained = renderer.explain(x, SIZE - 1 - y)
    assert explained.samples == counts[x, y]
    np.testing.assert_array_equal(explained.mean, renderer.image()[SIZE - 1 - y, x])
    even = tt.A3Renderer(box, SIZE, SIZE, adaptive=False).use("mis").render(error=0.03)
    assert renderer.samples < even.samples / 1.3


def test_passes_are_taken_at_once_where_tiles_are_impossible(box, scene):
    """There the shares may be small; no form then traces the eye rays of single passes."""
    assert adaptive.least_mean(tt.A3Renderer(box, 8, 8)) == adaptive.LEAST_MEAN
    assert adaptive.least_mean(tt.A4Renderer(scene, 8, 8)) == adaptive.LEAST_MEAN
    assert adaptive.least_mean(tt.A2Renderer(scene, 8, 8)) == adaptive.LEAST_ALONE
    renderer = tt.A4Renderer(box, 256, 256)
    renderer.plan.expect(Target(error=0.001), False)
    renderer.plan.choose_eye_rays()
    assert renderer.plan.passes_at_once == 1
    deviation = np.full((256, 256), 1e-6)
    deviation[100:108, 100:108] = 1
    renderer.own_shares.begin(shares_of(deviation))
    renderer.plan.expect(Target(error=0.001), False)
    assert renderer.shares.are_few
    assert isinstance(renderer.eye_rays, EyeRays)
    assert 60 <= renderer.plan.passes_at_once <= 64


def test_its_shares_end_with_the_picture(box, soon):
    renderer = tt.A3Renderer(box, SIZE, SIZE).use("mis")
    before = renderer.render(4).image()
    former = renderer.shares, renderer.plan
    renderer.begin_anew()
    renderer.render(error=0.03)
    own = renderer.shares, renderer.plan
    assert all(one is not other for one, other in zip(own, former, strict=True))
    renderer.begin_anew()
    np.testing.assert_array_equal(renderer.render(4).image(), before)
    assert (renderer.shares, renderer.plan) == former
    renderer.begin_anew()
    renderer.render(error=0.03)
    assert (renderer.shares, renderer.plan) == own
    renderer.use("brdf")
    renderer.render(1)
    assert not renderer.own_shares.is_on


@pytest.mark.parametrize(
    ("options", "target"),
    [
        ({"adaptive": False}, {"error": 0.03}),
        ({"sampler": "independent"}, {"error": 0.05}),
        ({}, {"spp": 64}),
        ({}, {"spp": 14, "error": 0.001}),
    ],
)
def test_nobody_else_begins_again(box, soon, options, target):
    """If only samples are counted, if it is not wanted, and if too few samples would be left."""
    renderer = tt.A3Renderer(box, SIZE, SIZE, **options).use("mis").render(**target)
    assert not renderer.own_shares.is_on
    assert np.ptp(renderer.film.counts()) == 0


def test_the_plain_form_begins_again_with_the_same_bits(box, soon):
    fast, plain = (
        tt.A3Renderer(box, 24, 24, fast=fast).use("environment").render(error=0.05) for fast in (True, False)
    )
    assert fast.own_shares.is_on
    assert plain.own_shares.is_on
    np.testing.assert_array_equal(plain.image(), fast.image())


def test_a_short_picture_does_not_begin_again(box):
    assert not tt.A3Renderer(box, SIZE, SIZE).use("mis").render(error=0.03).own_shares.is_on
