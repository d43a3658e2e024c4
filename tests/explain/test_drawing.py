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


def check_labels(svg):
    """Return the labels, none of which overlap or leave the drawing, with letters of a wide font of 12 pixels."""
    boxes = []
    for text in ElementTree.fromstring(svg).iter():
        if text.tag.endswith("text"):
            x, y = float(text.get("x")), float(text.get("y"))
            boxes.append((text.text, x, y - 10, x + 7.5 * len(text.text), y + 3))
    for k, (word, left, top, right, bottom) in enumerate(boxes):
        assert min(left, top, drawing.WIDTH - right, drawing.HEIGHT - bottom) >= 0, word
        for other, x0, y0, x1, y1 in boxes[:k]:
            assert right <= x0 or x1 <= left or bottom <= y0 or y1 <= top, (word, other)
    return [box[0] for box in boxes]


@pytest.mark.parametrize("spread", [1.0, 0.1, 1e-3, 0.0])
def test_labels_never_overlap_however_near_the_surfaces_are(spread):
    rng = np.random.default_rng(3)
    for _ in range(20):
        points = np.vstack([[0, 1, 3], spread * rng.normal(size=(5, 3))])
        arrows = [(point, drawing.unit(rng.normal(size=3)), drawing.LIGHT, "light") for point in points[1:]]
        assert len(check_labels(drawing.path_drawing(points, [TRIANGLE], arrows))) == 11
        directions = [(drawing.unit(rng.normal(size=3) + [0, 2, 0]), "#000", what) for what in ("BRDF", "light")]
        normal = np.array([0, 1.0, 0])
        assert len(check_labels(drawing.lobe_drawing(np.ones(9), normal, normal, directions))) == 4


def test_a_label_without_room_is_left_out():
    assert len(drawing.placed([((5.0, 5.0), (1, 0), "much too long a word " * 9)])) == 0
