"""The thumbnail is a small PNG with a ring around the pixel that is explained."""

import base64
import io
import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from PIL import Image

from taichi_tracer.explain.thumbnail import RING, SIDE, thumbnail
from taichi_tracer.tones.display import Display


@pytest.mark.parametrize("size", [(16, 24), (700, 500), (100, 1000)])
def test_the_ring_is_around_the_pixel(size):
    height, width = size
    image = np.zeros((height, width, 3), np.float32)
    column, row = width // 3, height // 4
    svg = thumbnail(image, column, row, Display(), True)
    root = ElementTree.fromstring(svg)
    (drawing,) = (one for one in root if one.tag == "svg")
    wide, high = float(drawing.get("width")), float(drawing.get("height"))
    assert max(wide, high) == SIDE
    assert wide / high == pytest.approx(width / height, rel=0.01)
    rings = [one for one in drawing if one.tag == "circle"]
    assert [ring.get("stroke") for ring in rings] == ["#000", "#fff"]  # one of them is seen on any ground
    for ring in rings:
        assert float(ring.get("cx")) / wide == pytest.approx((column + 0.5) / width, abs=0.01)
        assert float(ring.get("cy")) / high == pytest.approx((row + 0.5) / height, abs=0.01)
        assert float(ring.get("r")) == RING
    (data,) = re.findall(r"data:image/png;base64,([\w+/=]+)", svg)
    assert max(Image.open(io.BytesIO(base64.b64decode(data))).size) <= SIDE
