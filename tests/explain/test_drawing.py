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
    assert texts == ["eye", *(f"hit {k}" for k in range(1, len(points))), "light <1>"]
    numbers = [float(n) for n in re.findall(r"cx='([-\d.]+)'", svg)]
    assert all(0 <= n <= drawing.WIDTH for n in numbers)
