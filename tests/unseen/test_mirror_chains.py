"""Which lobes are narrow: decided by what a material says, and for BRDFs of somebody else's taken for granted."""

import pytest

from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.microfacet import Microfacet
from taichi_tracer.brdfs.phong import Mirror, Phong
from taichi_tracer.materials import Material
from taichi_tracer.system.parts import PARTS
from taichi_tracer.unseen.technique_check import may_be_narrow


class Own(Diffuse):
    """A BRDF that nobody registered."""

    name = "own"


@pytest.mark.parametrize(
    ("brdf", "material", "is_narrow"),
    [
        (Diffuse(), Material(), False),
        (Phong(), Material(Ns=99), False),
        (Phong(), Material(Ns=100), True),
        (Microfacet(), Material(alpha_x=0.3, alpha_y=0.1), False),
        (Microfacet(), Material(alpha_x=0.3, alpha_y=0.05), True),
        (Mirror(), Material(Ns=1e15), False),  # its light is found by its only direction
        (Own(), Material(), True),
    ],
)
def test_what_is_narrow(brdf, material, is_narrow):
    PARTS.all("BRDF")
    assert may_be_narrow(brdf, material) == is_narrow


def test_a_picture_of_roughness_may_hold_narrow_lobes():
    assert may_be_narrow(Microfacet(), Material(alpha_x=0.3, alpha_y=0.3, map_layer="roughness.png"))


def test_a_replaced_method_may_make_a_lobe_narrow(monkeypatch):
    monkeypatch.setattr(Diffuse, "pdf", lambda self, material, w_o, w_i, n: 1.0)
    assert may_be_narrow(Diffuse(), Material())
