"""Glass: which materials it is, and pictures in which light passes through it."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.system.parts import PARTS

GLASS = tt.Material("glass", Kd=(0.3, 0.3, 0.3), Ni=1.4, extra={"illum": (7.0,)})
VIEW = {"eye": (0, 0, 4), "at": (0, 0, 0), "fov": 40.0}


pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize(
    ("material", "is_glass"),
    [
        (GLASS, True),
        (tt.Material(d=0.5, Ni=1.5), True),
        (tt.Material(d=0.5), False),
        (tt.Material(Ni=1.5), False),
        (tt.Material(Ns=1000.0, Ni=1.4, extra={"illum": (7.0,)}), True),
        (tt.Material(Ns=1000.0, extra={"illum": (2.0,)}), False),
    ],
)
def test_what_is_glass(material, is_glass):
    """Glass counts before the other BRDFs that describe the material, too."""
    scene = tt.SceneData(Mesh(np.eye(3), np.array([[0, 1, 2]]), materials=[material]))
    found = scene.material_library.brdfs[scene.material_library.brdf_of[0][0]]
    assert (found is PARTS.find("BRDF", "dielectric")) == is_glass
