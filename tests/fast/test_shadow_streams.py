"""Streams of shadow rays: the answers of single rays, one by one, whatever the rays and the primitives."""

import numpy as np
import pytest
from shadows import check
from shapes import SQUARE, lattice, soup, sphere
from support import long_except

from taichi_tracer.fast.shadow_streams import ShadowStreams
from taichi_tracer.geometry import Mesh

pytestmark = pytest.mark.usefixtures("f32")


MESHES = {
    "soup": lambda rng: Mesh(*soup(rng, 400)),
    "lattice of whole numbers": lambda rng: Mesh(*lattice(rng, 120)),
    "closed sphere": lambda rng: Mesh(*sphere()),
    "square": lambda rng: Mesh(*SQUARE),
    "few triangles, in lanes": lambda rng: Mesh(*soup(rng, 40, 1.0)),
}


@pytest.mark.parametrize("name", long_except(MESHES, "few triangles, in lanes"))
def test_streams_answer_as_single_rays(name):
    check(MESHES[name](np.random.default_rng(0)), ShadowStreams, make=ShadowStreams)
