"""Adaptive sampling: unbiased, better where noise is uneven, and the same for every number of passes."""

import numpy as np
import pytest
from support import needs_lanes, start

import taichi_tracer as tt
from taichi_tracer.picture.adaptive import deviation_of_groups, shares_of

SIZE, SPP = 32, 64


@pytest.fixture(scope="module")
def scene():
    start("f32")
    return tt.load_scene_data("specular_spheres", environment="studio")


def test_shares_follow_the_deviation():
    shares = shares_of(np.kron([[0.0, 1.0], [2.0, 4.0]], np.ones((4, 4))))
    assert shares[0, 0] == 32
    assert shares[7, 7] == 256
    assert 32 < shares[0, 7] < shares[7, 0] < 256
    np.testing.assert_array_equal(shares_of(np.zeros((2, 2))), 256)


def test_the_pixels_of_a_group_have_one_share_that_of_the_mean_of_their_variances():
    """Groups begin at the bottom left; those at the upper and the right edge may have fewer pixels."""
    deviation = np.random.default_rng(2).uniform(1, 2, (10, 7))
    grouped = deviation_of_groups(deviation)
    assert grouped[9, 0] == pytest.approx(np.sqrt((deviation[6:10, 0:4] ** 2).mean()))
    assert grouped[0, 6] == pytest.approx(np.sqrt((deviation[0:2, 4:7] ** 2).mean()))
    shares = shares_of(deviation)
    assert shares.shape == deviation.shape
    for rows in (slice(0, 2), slice(2, 6), slice(6, 10)):
        for columns in (slice(0, 4), slice(4, 7)):
            assert np.ptp(shares[rows, columns]) == 0


@pytest.mark.long
def test_tiles_take_the_same_samples(scene):
    """Whole groups are left out in a pass, and packets none of whose groups takes a sample."""
    needs_lanes()
    images = []
    for use_tiles in (False, True):
        renderer = tt.A2Renderer(scene, 29, 26, adaptive=True).use("mis")
        renderer.use_tiles = use_tiles
        images.append(renderer.render(24).image())
        assert renderer.plan.in_tiles is use_tiles
        assert renderer.film.counts().min() < renderer.film.counts().max()
    np.testing.assert_array_equal(*images)


@pytest.mark.exhaustive
def test_it_is_unbiased_and_better(scene):
    """z of the mean of 8 pictures beyond 4 would have p < 1e-4; the noise is on a fifth of the pixels."""
    truth = tt.A2Renderer(scene, SIZE, SIZE, seed=5).use("mis").render(1024)
    plain = tt.A2Renderer(scene, SIZE, SIZE).use("mis")
    adaptive = tt.A2Renderer(scene, SIZE, SIZE, adaptive=True).use("mis")
    means, errors = [], {plain: [], adaptive: []}
    for seed in range(8):
        for renderer, values in errors.items():
            renderer.seed = seed
            renderer.begin_anew()
            renderer.render(SPP)
            values.append(((renderer.image() - truth.image()) ** 2).mean())
        means.append(adaptive.image().mean(dtype=np.float64))
    spread = np.std(means, ddof=1) / np.sqrt(len(means)) + truth.film.variance_of_mean().mean() ** 0.5 / SIZE
    assert abs(np.mean(means) - truth.image().mean(dtype=np.float64)) < 4 * spread
    assert np.mean(errors[adaptive]) < 0.8 * np.mean(errors[plain])
    assert SPP <= adaptive.samples <= SPP + 1
    counts = adaptive.film.counts()
    assert counts.mean() == pytest.approx(SPP, rel=0.05)
    assert counts.max() > 3 * counts.min() > 0


@pytest.mark.exhaustive
def test_packets_take_the_same_samples(scene):
    images = []
    for use_packets in (False, True):
        renderer = tt.A2Renderer(scene, 16, 16, adaptive=True).use("brdf")
        renderer.plan.choose_eye_rays(in_tiles=True)
        renderer.eye_rays.use_packets = use_packets
        images.append(renderer.render(24).image())
        assert (renderer.eye_rays.packets is not None) is use_packets
    np.testing.assert_array_equal(*images)


def test_views_have_nothing_to_adapt_to(scene):
    with pytest.raises(tt.InputError, match="adaptive sampling needs random samples"):
        tt.A1Renderer(scene, 8, 8, adaptive=True)
    with pytest.raises(tt.InputError, match="adaptive sampling cannot go on"):
        tt.A2Renderer(scene, 8, 8, adaptive=True).save_checkpoint("x.checkpoint")
