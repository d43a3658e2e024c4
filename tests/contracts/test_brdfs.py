"""Every registered BRDF keeps the contract of ``brdfs.base``; those that break it in one point are found."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from contracts.registered import broken_parts, check_fails, check_part, every
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.contracts import brdfs

pytestmark = pytest.mark.usefixtures("f32")


@every("BRDF", only=lambda part: part.name != "dielectric")  # it has two directions: tests/brdfs
def test_brdf(part):
    check_part(part)


@ti.data_oriented
class OneWay(Diffuse):
    """Helmholtz's reciprocity does not hold: the viewer's cosine counts, the light's does not."""

    name = "broken: not reciprocal"

    @ti.func
    def eval(self, material, w_o, w_i, n):
        return material.Kd / tm.pi * ti.max(0.0, tm.dot(n, w_o))


@ti.data_oriented
class AdmitsOneWay(OneWay):
    name, is_reciprocal = "not reciprocal, and says so", False


@ti.data_oriented
class TooBright(Diffuse):
    name = "broken: reflects more than arrives"

    @ti.func
    def eval(self, material, w_o, w_i, n):
        return 1.3 * tm.vec3(1) / tm.pi


@broken_parts({OneWay: "not reciprocal", TooBright: "reflects 1.3"})
def test_broken_brdf_is_found(broken, reason):
    check_fails(broken, check_part, reason)


def test_what_is_not_promised_is_not_held_against_it():
    assert brdfs.check_reciprocity in brdfs.steps(OneWay())
    assert brdfs.check_reciprocity not in brdfs.steps(AdmitsOneWay())


def test_a_brdf_without_materials_is_known_by_that():
    class Nothing(Diffuse):
        name = "nothing"

        def describes(self, material, dtype):
            return False

    assert brdfs.described_materials(Nothing()) == []


def test_own_parameters_are_tried():
    class Rough(Diffuse):
        name, parameters = "rough", {"roughness": 0.5, "tint": (1.0, 0.5, 0.0)}

        def describes(self, material, dtype):
            return "roughness" in material.extra

    tried = brdfs.described_materials(Rough())
    assert [m.value("roughness", 0.0) for m in tried] == [0.5, 0.25, 0.125]
    np.testing.assert_allclose(tried[1].value("tint", (0.0, 0.0, 0.0)), (0.5, 0.25, 0))
    assert tt.Material().extra == {}
