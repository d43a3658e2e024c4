"""Exposure and tone curve together, and that nothing is changed unless it is asked for."""

import numpy as np
import pytest
from oracles import tones

import taichi_tracer as tt
from taichi_tracer.files.images import to_bytes
from taichi_tracer.tones.display import Display, fitting_exposure, share_in_the_dark

LIGHT = np.random.default_rng(1).gamma(0.7, 2.0, (9, 7, 3)).astype(np.float32)


def test_a_plain_display_changes_no_bit():
    assert Display().is_plain
    np.testing.assert_array_equal(Display().shown(LIGHT), np.clip(LIGHT.astype(np.float64), 0, 1))


@pytest.mark.parametrize("stops", [-3, -0.5, 1, 2.25])
def test_a_stop_doubles_the_light(stops):
    shown = Display(stops).shown(LIGHT)
    np.testing.assert_array_equal(shown, np.clip(LIGHT.astype(np.float64) * 2.0**stops, 0, 1))


def test_the_curve_follows_the_exposure():
    x = np.minimum(LIGHT.astype(np.float64) / 2, 5.6)
    np.testing.assert_allclose(Display(-1, "filmic").shown(LIGHT), tones.uncharted2(x), atol=1e-12)


def test_bytes_are_exposed_bent_and_encoded_in_this_order():
    expected = tones.srgb(tones.uncharted2(np.minimum(2.0 * LIGHT.astype(np.float64), 5.6)))
    got = to_bytes(LIGHT, srgb=True, display=Display(1, "filmic"))
    assert abs(got.ravel() / 255 - expected).max() <= 0.5 / 255 + 1e-9


@pytest.mark.parametrize("display", [Display(), Display(60), Display(-60, "filmic"), Display(3, "filmic")])
def test_numbers_that_are_not_finite_are_shown(display):
    values = np.array([[[np.nan, -np.inf, np.inf], [-5, 3e38, 0]]], np.float32)
    shown = display.shown(values)[0]
    assert shown[0].tolist() == [0, 0, pytest.approx(1)]
    assert (shown[1][0], shown[1][2]) == (0, 0)
    assert 0 <= shown[1][1] <= 1


@pytest.mark.parametrize(
    ("exposure", "tone", "message"),
    [
        (float("nan"), "none", "between -64 and 64 stops, not nan: 1 doubles the light"),
        (float("inf"), "none", "not inf"),
        (65, "none", "not 65"),
        ("bright", "none", "not 'bright'"),
        (0, "filmc", "unknown tone curve 'filmc': did you mean 'filmic'?"),
        (0, tt.Camera, "is neither a name nor a part of this kind"),
    ],
)
def test_what_cannot_be_is_an_error_with_its_value(exposure, tone, message):
    with pytest.raises(tt.InputError) as error:
        Display(exposure, tone)
    assert message in str(error.value)


def test_a_curve_may_be_a_name_a_class_or_an_object():
    class Square(tt.Tone):
        name = "square"

        def curve(self, x):
            return x * x

    for tone in (Square, Square()):
        assert Display(tone=tone).shown(np.full((1, 1, 3), 0.5)).tolist() == [[[0.25] * 3]]


def test_a_display_says_what_it_is():
    assert str(Display(-1.5, "filmic")) == "exposure -1.5 stops, tone curve filmic"


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1.0, 1e6])
def test_the_fitting_exposure_shows_nine_tenths_of_the_light_below_white(scale):
    image = np.zeros((20, 20, 3), np.float32)
    image[5:15] = scale * np.linspace(0.1, 1, 200).reshape(10, 20, 1)
    stops = fitting_exposure(image)
    bright = 0.91 * scale * 2.0**stops
    assert 0.5 / 2**0.5 <= bright <= 0.5 * 2**0.5
    assert share_in_the_dark(image, Display(stops)) == 0
    assert share_in_the_dark(image, Display(stops - 20)) == 1


def test_what_has_no_light_needs_no_exposure():
    image = np.zeros((2, 2, 3), np.float32)
    image[0, 0] = np.nan
    assert fitting_exposure(image) == 0
    assert share_in_the_dark(image, Display()) == 0
