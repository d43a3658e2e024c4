"""What a denoiser adds is measured with samples that it has not seen, and is told."""

import math

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.picture import denoised as module
from taichi_tracer.picture.denoised import without_fireflies
from taichi_tracer.picture.metrics import relative_rmse

pytestmark = pytest.mark.usefixtures("f32")
SIZE = 48


class Filter:
    """In the place of Open Image Denoise: a known bias and a known part of the noise."""

    def __init__(self, bias, share):
        self.bias, self.share = bias, share

    def denoise(self, colour, albedo, normal, hdr):
        assert hdr
        assert albedo.shape == normal.shape == colour.shape
        assert np.isfinite(albedo).all()
        assert np.isfinite(normal).all()
        return (self.truth + self.bias + self.share * (colour - self.truth)).astype(np.float32)


@pytest.fixture(scope="module")
def scene():
    return tt.load_scene_data("cube", environment="white")


@pytest.fixture(scope="module")
def truth(scene):
    return np.asarray(tt.A3Renderer(scene, SIZE, SIZE, seed=9).use("hemisphere").render(1024).image(), np.float64)


def told_with(scene, truth, monkeypatch, bias, share, spp=16):
    one = Filter(bias, share)
    one.truth = truth
    monkeypatch.setattr(module, "denoiser", lambda: one)
    renderer = tt.A3Renderer(scene, SIZE, SIZE, sampler="niederreiter_two").use("hemisphere").render(spp)
    return renderer, renderer.denoised()


def test_the_bias_and_the_noise_that_is_left_are_told_apart(scene, truth, monkeypatch):
    """A bias of a tenth of the mean, and a fifth of the noise of half of the samples."""
    bias = 0.1 * truth.mean()
    renderer, found = told_with(scene, truth, monkeypatch, bias, 0.2)
    noise = relative_rmse(renderer.image(), truth)
    assert found.noise == pytest.approx(noise, rel=0.1)
    assert found.bias == pytest.approx(0.1, rel=0.05)
    assert found.error == pytest.approx(math.hypot(0.1, 0.2 * math.sqrt(2) * noise), rel=0.05)
    assert found.error <= found.high < 1.5 * found.error
    np.testing.assert_allclose(found.image, truth + bias + 0.2 * (np.asarray(renderer.image()) - truth), atol=1e-3)
    assert f"{100 * found.bias:.3g} % is bias that this added; the noise was " in str(found)


# ── clamped ──


def test_a_pixel_is_cut_to_its_brightest_neighbour_with_its_colour():
    image = np.full((4, 5, 3), 0.5, np.float32)
    image[1, 2] = 8, 4, 2
    image[3, 0] = 0.9, 0.1, 0.2  # not twice as bright as its neighbours
    expected = image.copy()
    expected[1, 2] = 1, 0.5, 0.25
    np.testing.assert_allclose(without_fireflies(image, 2.0), expected, rtol=1e-6)
    np.testing.assert_array_equal(without_fireflies(expected, 2.0), expected)
    np.testing.assert_array_equal(without_fireflies(image[:1, :1], 2.0), image[:1, :1])
    two = image.copy()
    two[1, 3] = 8  # a lamp of two pixels is no firefly
    np.testing.assert_array_equal(without_fireflies(two, 2.0), two)


def test_the_command_line_clamps_or_denoises(tmp_path, capsys):
    words = ["render", "cube", "--environment", "white", "--estimator", "brdf", "--size", "16x16", "--spp", "4"]
    assert main([*words, "--clamp", "1.5", "-o", str(tmp_path / "a.png")]) == 0
    assert "a.png: 16x16, 4 spp, clamped: error " in capsys.readouterr().out
    for wrong, told in (
        (["--clamp", "0.2"], "clamp must be a number from 1 on, not 0.2"),
        (["--clamp", "2", "--denoise"], "--denoise: not allowed with argument --clamp"),
    ):
        assert main([*words, *wrong, "-o", str(tmp_path / "b.png")]) == 2
        assert told in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
