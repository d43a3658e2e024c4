"""Adaptive sampling: unbiased, better where noise is uneven, and the same for every number of passes."""

import numpy as np
import pytest
import taichi as ti
from support import start

import taichi_tracer as tt
from taichi_tracer.picture import adaptive
from taichi_tracer.picture.adaptive import (
    POWER,
    SMALLEST,
    WHOLE,
    Shares,
    shares_of,
)

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


def test_a_pixel_takes_its_samples_one_after_the_other_at_any_pass(scene):
    """As ⌈pass · share / WHOLE⌉ says, beyond 2^32 / WHOLE passes, too; all take one in the first pass."""
    rng, shares = np.random.default_rng(1), Shares(4, 4)
    shares.set(rng.integers(1, WHOLE + 1, (4, 4)).astype(np.int32))
    own = shares.to_image()[::-1].T
    for first in (0, WHOLE - 3, 2**20 - 5, 2**31):
        for index in range(first, first + 9):
            found = taken(shares, index)
            before, after = (-(-(index + k) * own.astype(np.int64) // WHOLE) for k in (0, 1))
            np.testing.assert_array_equal(found[..., 0].astype(np.uint32), before)
            np.testing.assert_array_equal(found[..., 1], after - before)
    assert shares.range_of(1, 2, 5, 2**31) == tuple(-(-k * int(own[1, 2]) // WHOLE) for k in (5, 2**31))


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


def test_a_short_picture_has_all_its_pixels_and_the_seconds_of_its_pilot(scene):
    renderer = tt.A2Renderer(scene, SIZE, SIZE, adaptive=True).use("mis").render(time=1e-6)
    assert renderer.samples == 1
    assert (renderer.film.counts() > 0).all()
    assert renderer.progress.seconds > renderer.progress.pilot.seconds > 0


def test_passes_at_once_take_the_same_samples(scene):
    """Beyond 2^31, too, where the number of a pass is no signed word."""
    images = []
    for passes in (1, 4, 8):
        renderer = tt.A2Renderer(scene, 8, 8, adaptive=True).use("brdf").render(1)
        renderer.shares.set(np.kron([[WHOLE, 5], [WHOLE // 7, WHOLE // 3]], np.ones((4, 4), int)).astype(np.int32))
        assert renderer.passes_at_once == 2
        renderer.reset()
        for first in range(2**31 - 8, 2**31 + 8, passes):
            renderer.add_sample(first, passes)
        assert renderer.film.counts().max() == 16
        images.append(renderer.film.image())
    np.testing.assert_array_equal(images[0], images[1])
    np.testing.assert_array_equal(images[0], images[2])


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


@pytest.mark.slow
def test_a_long_picture_of_uneven_noise_begins_again_with_shares(box, soon):
    """It has the samples of those indices, in each pixel as many as its share allows, and knows its error."""
    renderer = tt.A3Renderer(box, SIZE, SIZE).use("mis").render(error=0.03)
    assert renderer.shares.are_uneven
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


@pytest.mark.slow
def test_its_shares_end_with_the_picture(box, soon):
    renderer = tt.A3Renderer(box, SIZE, SIZE).use("mis")
    before = renderer.render(4).image()
    renderer.begin_anew()
    renderer.render(error=0.03)
    assert renderer.shares.are_uneven
    renderer.begin_anew()
    np.testing.assert_array_equal(renderer.render(4).image(), before)
    assert not renderer.shares.are_uneven
