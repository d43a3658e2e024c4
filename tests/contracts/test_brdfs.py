"""Every registered BRDF keeps the contract of ``brdfs.base``; those that break it in one point are found."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from contracts.registered import broken_parts, check_fails, every
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.mirror import Mirror
from taichi_tracer.brdfs.phong import Phong
from taichi_tracer.contracts import brdfs

pytestmark = pytest.mark.usefixtures("f32")


@every("BRDF")
def test_brdf(part):
    if not brdfs.described_materials(part):
        pytest.skip(f"{part.name} describes none of the trial materials")
    brdfs.check_brdf(part)


@ti.data_oriented
class TwiceTheDensity(Diffuse):
    name = "broken: pdf twice too large"

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        return 2 * ti.max(0.0, tm.dot(n, w_i)) / tm.pi


@ti.data_oriented
class IgnoresTheNormal(Diffuse):
    name = "broken: always about +z"

    @ti.func
    def sample(self, material, w_o, n, xi):
        r, phi = ti.sqrt(1 - xi.x), 2 * tm.pi * xi.y
        return tm.vec3(r * ti.cos(phi), r * ti.sin(phi), ti.sqrt(xi.x))


@ti.data_oriented
class SlightlyOff(Phong):
    """The pdf is that of an exponent 7 % larger: a mistake that no picture shows."""

    name = "broken: another exponent"

    def describes(self, material, dtype):
        return 1 < material.Ns < 1e5

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        reflected = 2 * tm.dot(n, w_o) * n - w_o
        exponent = 1.07 * material.Ns
        return (exponent + 1) / (2 * tm.pi) * ti.max(0.0, tm.dot(reflected, w_i)) ** exponent


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
class WrongWeight(Diffuse):
    name = "broken: weight forgets to cancel"

    @ti.func
    def weight(self, material, w_o, w_i, n):
        return material.Kd * ti.max(0.0, tm.dot(n, w_i))


@ti.data_oriented
class TooBright(Diffuse):
    name = "broken: reflects more than arrives"

    @ti.func
    def eval(self, material, w_o, w_i, n):
        return 1.3 * tm.vec3(1) / tm.pi


@ti.data_oriented
class NanBelow(Diffuse):
    name = "broken: NaN below the horizon"

    @ti.func
    def eval(self, material, w_o, w_i, n):
        return material.Kd / tm.pi * ti.sqrt(tm.dot(n, w_i)) / ti.sqrt(tm.dot(n, w_i))


@ti.data_oriented
class ForgetsPart(Diffuse):
    """Half of the hemisphere is never sampled, though neither f_r nor pdf is 0 there."""

    name = "broken: samples half"

    @ti.func
    def sample(self, material, w_o, n, xi):
        w_i = Diffuse.sample(self, material, w_o, n, xi)
        return ti.select(w_i.x < 0, -w_i + 2 * tm.dot(w_i, n) * n, w_i)


@ti.data_oriented
class LeavesASide(Diffuse):
    name = "broken: says that it reaches all directions"

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        return ti.select(w_i.x < 0, 0.0, 2 * ti.max(0.0, tm.dot(n, w_i)) / tm.pi)


@ti.data_oriented
class ScatteringMirror(Mirror):
    name = "broken: a delta BRDF with a pdf"

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        return 1.0


@ti.data_oriented
class TiltedMirror(Mirror):
    name = "broken: a mirror that does not reflect back"

    @ti.func
    def sample(self, material, w_o, n, xi):
        return tm.normalize(2 * tm.dot(n, w_o) * n - w_o + 0.1 * n)


@pytest.mark.long
@broken_parts(
    {
        TwiceTheDensity: "integral of pdf is 1.99|integral of pdf is 2.0",
        IgnoresTheNormal: "not those of pdf",
        SlightlyOff: "not those of pdf",
        OneWay: "not reciprocal",
        WrongWeight: "weight is not f cos/pdf",
        TooBright: "reflects 1.3",
        NanBelow: "eval is nan",
        ForgetsPart: "not those of pdf",
        LeavesASide: "but its pdf is 0 there",
        ScatteringMirror: "pdf of a delta BRDF is 0",
        TiltedMirror: "does not reflect back",
    }
)
def test_broken_brdf_is_found(broken, reason):
    check_fails(broken, brdfs.check_brdf, reason)


def test_what_is_not_promised_is_not_held_against_it():
    brdfs.check_reciprocity(AdmitsOneWay())


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
