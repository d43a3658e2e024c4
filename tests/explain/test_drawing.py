"""The drawings are well-formed SVG, whatever the path is, and y points upwards in them."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from taichi_tracer.explain import drawing

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1.0]])


@pytest.mark.parametrize(
    "points",
    [
        [[0, 1, 3], [0.2, 0, 0.2]],
        [[0, 5, 0.2], [0, 0, 0.2]],  # straight down
        [[0, 1, 3], [0.2, 0, 0.2], [1, 2, 0]],
        [[0, 1, 3], [0, 0.5, 1.5], [0, 0, 0]],  # on one line
    ],
)
def test_a_path_is_drawn_with_y_upwards(points):
    points = np.array(points, float)
    frame = drawing.plane_of(points, [TRIANGLE])
    assert np.allclose(frame @ frame.T, np.eye(2), atol=1e-9)
    assert frame[1, 1] >= -1e-12
    assert abs(frame[0, 1]) < 1e-9
    svg = drawing.path_drawing(points, [TRIANGLE], [(points[1], np.array([0, 1.0, 0]), drawing.LIGHT, "light <1>")])
    root = ElementTree.fromstring(svg)
    texts = [t.text for t in root.iter() if t.tag.endswith("text")]
    assert texts[0] == "light <1>"
    assert texts[1:] == ["eye", *(f"hit {k}" for k in range(1, len(points)))]
    numbers = [float(n) for n in re.findall(r"cx='([-\d.]+)'", svg)]
    assert all(0 <= n <= drawing.WIDTH for n in numbers)


@pytest.mark.parametrize("w_o", [[0, 1, 0], [0.6, 0.8, 0]])
def test_a_lobe_is_drawn_also_where_the_viewer_is_above(w_o):
    lobe = np.cos(np.linspace(-np.pi / 2, np.pi / 2, 181))
    svg = drawing.lobe_drawing(
        lobe, np.array(w_o, float), np.array([0, 1.0, 0]), [(np.array([0, 0, 1.0]), "#000", "x")]
    )
    ElementTree.fromstring(svg)
    assert "nan" not in svg


def test_a_black_lobe_is_a_point():
    assert "nan" not in drawing.lobe_drawing(np.zeros(11), np.array([0, 1.0, 0]), np.array([0, 1.0, 0]), [])
