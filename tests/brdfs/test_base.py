"""The interface of BRDFs: what is asked of a subclass, and which weight counts when only a part was replaced."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import light
from probe import brdf_values

from taichi_tracer.brdfs.base import Brdf, owns_weight
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.phong import Phong


@ti.data_oriented
class WithoutWeight(Brdf):
    """Says what it must, and leaves the weight to the base class."""

    @ti.func
    def eval(self, material, w_o, w_i, n):
        return material.Kd * tm.dot(n, w_i)

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        return ti.max(0.0, tm.dot(n, w_i)) / tm.pi

    @ti.func
    def sample(self, material, w_o, n, xi):
        return n


@ti.data_oriented
class OtherDensity(Diffuse):
    """Inherits a weight that belongs to another density."""

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        return 1 / (2 * tm.pi)


@ti.data_oriented
class OtherDensityAndWeight(OtherDensity):
    """Says both."""

    @ti.func
    def weight(self, material, w_o, w_i, n):
        return material.Kd * 7


@ti.data_oriented
class SampleWeight(Brdf):
    """Shows as its weight what integrators ask of another BRDF."""

    def __init__(self, of):
        self.of = of

    @ti.func
    def eval(self, material, w_o, w_i, n):
        return self.of.eval(material, w_o, w_i, n)

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        return self.of.pdf(material, w_o, w_i, n)

    @ti.func
    def weight(self, material, w_o, w_i, n):
        return self.of.sample_weight(material, w_o, w_i, n)


def test_the_weight_is_f_cos_over_pdf_where_a_subclass_says_none(f32, rng):
    w_i = light.hemisphere(rng, 1_000)
    w_i = w_i[w_i[:, 2] > 1e-3]
    f, pdf, weight = brdf_values(WithoutWeight(), 1.0, w_i, w_i).T
    np.testing.assert_allclose(weight, f * w_i[:, 2] / pdf, rtol=1e-5)


@pytest.mark.parametrize(
    ("brdf", "is_own"),
    [
        (Diffuse(), True),
        (Phong(), True),
        (WithoutWeight(), False),
        (OtherDensity(), False),
        (OtherDensityAndWeight(), True),
    ],
)
def test_a_weight_counts_only_with_the_density_it_was_written_for(brdf, is_own):
    assert owns_weight(brdf) is is_own


def test_integrators_ask_for_a_weight_that_belongs_to_the_density(f32, rng):
    w = light.hemisphere(rng, 500)
    cosine, kd = w[:, 2].astype(np.float32).astype(float), 0.75
    np.testing.assert_allclose(brdf_values(SampleWeight(Diffuse()), 1.0, w, w)[:, 2], kd, rtol=1e-6)
    found = brdf_values(SampleWeight(OtherDensity()), 1.0, w, w)[:, 2]
    np.testing.assert_allclose(found, kd / np.pi * cosine * 2 * np.pi, rtol=1e-5)
    np.testing.assert_allclose(brdf_values(SampleWeight(OtherDensityAndWeight()), 1.0, w, w)[:, 2], 7 * kd, rtol=1e-6)


def test_assigning_to_the_shipped_class_makes_its_weight_another_ones(monkeypatch):
    @ti.func
    def constant(self, material, w_o, w_i, n):
        return material.Kd

    monkeypatch.setattr(Phong, "eval", constant)
    assert not owns_weight(Phong())


@pytest.mark.parametrize("method", ["eval", "pdf", "sample"])
def test_what_a_subclass_does_not_say_is_asked_for_by_name(f32, method):
    @ti.data_oriented
    class Unfinished(Brdf):
        pass

    brdf, n = Unfinished(), tm.vec3(0, 0, 1)

    @ti.kernel
    def use():
        if ti.static(method == "sample"):
            print(brdf.sample(0, n, n, tm.vec2(0)))
        elif ti.static(method == "eval"):
            print(brdf.eval(0, n, n, n))
        else:
            print(brdf.pdf(0, n, n, n))

    with pytest.raises(ti.TaichiCompilationError, match=rf"a BRDF must say what {method}\(self"):
        use()
    with pytest.raises(NotImplementedError, match="Unfinished must say which materials it describes"):
        brdf.describes(None, np.float32)
