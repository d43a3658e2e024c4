"""Views: their windows, against the document, and what they say of themselves."""

import numpy as np
import pytest
from oracles import cameras as oracle

from taichi_tracer.formulas import view as views

PLACE = {"eye": np.array([0.0, 0.0, 5.0]), "at": np.zeros(3), "up": np.array([0.0, 1.0, 0.0])}


@pytest.mark.parametrize(
    "shape", [{}, {"fovy": 30.0}, {"fovy": 120.0, "focal_distance": 2.5}, {"screen_window": (-3.0, 1.0, 0.5, 2.0)}]
)
def test_windows_are_those_of_the_document(shape):
    """RT-3, RT-4, for wide and high images."""
    told = {"fov" if name == "fovy" else name: value for name, value in shape.items()}
    for width, height in ((6, 4), (4, 6), (5, 5)):
        window = views.CameraView(**PLACE, **told).window(width / height)
        assert window == pytest.approx(oracle.window(width, height, **shape))


def test_a_square_is_stretched_where_window_and_image_differ_in_shape():
    """C-11."""
    assert views.CameraView(**PLACE, screen_window=(-5.3, 5.3, -4, 4)).stretch(2800, 1800) == pytest.approx(
        1.174, abs=1e-3
    )
    assert views.CameraView(**PLACE, screen_window=(-3, 1, 0, 2)).stretch(80, 40) == 1


def test_a_view_does_not_change_with_the_arrays_that_it_was_made_of():
    values = {**PLACE, "eye": np.array([0.0, 0.0, 5.0]), "fov": 60, "screen_window": None}
    usual = {"handedness": "left", "frame_aspect": None, "focal_distance": 1}
    view = views.CameraView.checked({**values, **usual}, views.check_angle)
    values["eye"][0] = 9
    np.testing.assert_array_equal(view.eye, [0, 0, 5])
