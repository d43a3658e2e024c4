"""Reflection against its formulas in float64: values, lobes beyond what cos can hold, and which material has which."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import light
from support import start

import taichi_tracer as tt
from taichi_tracer import brdf
from taichi_tracer.materials import Material, MaterialValues
from taichi_tracer.system import runtime


@ti.kernel
def _values(kind: ti.template(), ns: float, wo: ti.types.ndarray(), wi: ti.types.ndarray(), out: ti.types.ndarray()):
    for i in range(wo.shape[0]):
        n = tm.vec3(0, 0, 1)
        w_o, w_i = tm.vec3(wo[i, 0], wo[i, 1], wo[i, 2]), tm.vec3(wi[i, 0], wi[i, 1], wi[i, 2])
        m = MaterialValues(Ns=ns, Kd=tm.vec3(0.75, 0.5, 0.25))
        out[i, 0] = kind.eval(m, w_o, w_i, n).x
        out[i, 1] = kind.pdf(m, w_o, w_i, n)
        out[i, 2] = kind.weight(m, w_o, w_i, n).x


def values(kind, ns, w_o, w_i):
    out = np.zeros((len(w_o), 3), runtime.dtype())
    _values(kind, ns, *(np.ascontiguousarray(w, runtime.dtype()) for w in (w_o, w_i)), out)
    return out.astype(np.float64)


@pytest.fixture
def directions(rng):
    w_o = light.to_unit(rng.normal(size=(20_000, 3)))
    w_o[:, 2] = np.abs(w_o[:, 2])
    return w_o, light.to_unit(rng.normal(size=(20_000, 3)))


def test_diffuse(precision, directions):
    f, pdf, weight = values(brdf.Diffuse, 1.0, *directions).T
    np.testing.assert_allclose(f, 0.75 / np.pi, rtol=1e-6)
    np.testing.assert_allclose(pdf, np.maximum(directions[1][:, 2], 0) / np.pi, atol=1e-7)
    np.testing.assert_allclose(weight, 0.75)


@pytest.mark.parametrize("ns", [1.5, 2, 50, 1e3])
def test_phong(precision, directions, ns):
    """C-2: the cosine is clamped before the power, so that an even α does not light the back."""
    w_o, w_i = directions
    near = light.to_unit(w_o * [-1, -1, 1] + np.random.default_rng(1).normal(size=w_o.shape) * 3 / np.sqrt(ns))
    w_i = np.where(np.arange(len(w_i))[:, None] % 2 == 0, near, w_i)
    f, pdf, weight = values(brdf.Phong, ns, w_o, w_i).T
    dtype = runtime.dtype()
    o, i = w_o.astype(dtype).astype(float), w_i.astype(dtype).astype(float)
    reflected = o * [-1, -1, 1]
    cosine = np.maximum((reflected * i).sum(1), 0)
    expected = (ns + 1) / (2 * np.pi) * cosine**ns
    tolerance = (3e-4 if ns > 100 else 2e-5) if precision == "f32" else 1e-9
    np.testing.assert_allclose(pdf, expected, rtol=tolerance, atol=1e-5)
    np.testing.assert_allclose(f, 0.75 * pdf, rtol=1e-6)
    np.testing.assert_allclose(weight, 0.75 * np.maximum(i[:, 2], 0), atol=1e-6)
    assert (f[(reflected * i).sum(1) < 0] == 0).all()


@pytest.mark.parametrize("ns", [1e6, 1e9, 1e12])
def test_narrow_lobes_keep_their_shape(ns):
    """Where cos has rounded to 1, the pdf still falls as exp(−α θ²/2)."""
    start("f32")
    angle = np.linspace(0, 3, 50) / np.sqrt(ns)
    w_i = np.stack([np.sin(angle), np.zeros(50), np.cos(angle)], axis=1).astype(np.float32)
    pdf = values(brdf.Phong, ns, np.tile([0.0, 0.0, 1.0], (50, 1)), w_i)[:, 1]
    exact = (ns + 1) / (2 * np.pi) * np.exp(-ns * w_i[:, 0].astype(float) ** 2 / 2)
    np.testing.assert_allclose(pdf, exact, rtol=1e-3)


def test_mirror_reflects_into_one_direction():
    start("f32")
    w_o = np.array([[0.6, 0.0, 0.8]])
    assert not values(brdf.Mirror, 1e21, w_o, [[-0.6, 0, 0.8]])[0, :2].any()
    np.testing.assert_allclose(values(brdf.Mirror, 1e21, w_o, [[-0.6, 0, 0.8]])[0, 2], 0.75 * 0.8, rtol=1e-6)


@pytest.mark.parametrize(
    ("ns", "f32", "f64"),
    [
        (0, "diffuse", "diffuse"),
        (0.5, "diffuse", "diffuse"),
        (1, "diffuse", "diffuse"),
        (1.0001, "phong", "phong"),
        (1e12, "phong", "phong"),
        (1e21, "mirror", "phong"),
        (1e36, "mirror", "mirror"),
    ],
)
def test_the_exponent_says_which(ns, f32, f64):
    """C-4, and C-3: a lobe narrower than the precision is a mirror's."""
    material = Material(Ns=ns)
    assert brdf.ALL[brdf.brdf_of(material, np.float32)].name == f32
    assert brdf.ALL[brdf.brdf_of(material, np.float64)].name == f64


def test_every_material_of_the_shipped_scenes_has_one():
    start("f32")
    scene = tt.load_scene_data("specular_spheres")
    assert [brdf.ALL[brdf.brdf_of(m, np.float32)].name for m in scene.materials] == ["diffuse", "phong", "mirror"]
