"""Materials reach kernels with the values that the file has, and each has one BRDF."""

import dataclasses

import numpy as np
import pytest
import taichi as ti

from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.microfacet import Microfacet
from taichi_tracer.brdfs.mirror import Mirror
from taichi_tracer.brdfs.phong import Phong
from taichi_tracer.materials import Material, MaterialLibrary
from taichi_tracer.system import memory, runtime

SHIPPED = (Diffuse(), Phong(), Mirror(), Microfacet())


def library_of(materials, brdfs=SHIPPED):
    """A library that is ready for kernels, and the memory that holds it."""
    owner = memory.Memory()
    with owner as fields:
        library = MaterialLibrary(materials, list(brdfs), fields)
    library.tables().load(owner)
    return library, owner


@ti.kernel
def _read(library: ti.template(), i: int, out: ti.types.ndarray(ndim=1)):
    m = library.get(i)
    for k in ti.static(range(3)):
        out[k], out[3 + k], out[6 + k], out[9 + k], out[12 + k] = m.Kd[k], m.Ka[k], m.Ks[k], m.Ke[k], m.F0[k]
    out[15], out[16], out[17], out[18], out[19] = m.Ns, m.Ni, m.d, m.alpha_x, m.alpha_y


def test_every_value_arrives_under_its_own_name(precision, rng):
    def colour():
        return tuple(rng.uniform(size=3))

    made = [
        Material(
            f"m{i}",
            Kd=colour(),
            Ka=colour(),
            Ks=colour(),
            Ke=colour(),
            F0=colour(),
            **dict(zip(("Ns", "Ni", "d", "alpha_x", "alpha_y"), rng.uniform(1, 9, 5), strict=True)),
        )
        for i in range(3)
    ]
    library, _owner = library_of(made)
    for i, m in enumerate(made):
        out = np.zeros(20, runtime.dtype())
        _read(library, i, out)
        expected = np.concatenate([m.Kd, m.Ka, m.Ks, m.Ke, m.F0, [m.Ns, m.Ni, m.d, m.alpha_x, m.alpha_y]])
        np.testing.assert_array_equal(out, expected.astype(runtime.dtype()))


# ── which material has which BRDF ──


@pytest.mark.parametrize(
    ("ns", "name"),
    [
        (0, "diffuse"),
        (0.5, "diffuse"),
        (1, "diffuse"),
        (1.0001, "phong"),
        (1e12, "phong"),
        (1e21, "mirror"),
        (1e36, "mirror"),
    ],
)
def test_the_exponent_says_which(precision, ns, name):
    """C-4, and C-3: a lobe narrower than f32 is a mirror's. Exactly one of the shipped BRDFs describes it."""
    library, _owner = library_of([Material(Ns=ns)])
    assert SHIPPED[library.brdf_of[0][0]].name == name
    assert library.brdf_ids[0, 0] == library.brdf_of[0][0]
    assert sum(brdf.describes(Material(Ns=ns), runtime.dtype()) for brdf in SHIPPED) == 1


@ti.data_oriented
class Velvet(Brdf):
    """A BRDF with parameters of its own."""

    name, needs = "velvet", "a material with a sheen"
    parameters = {"sheen": 0.25, "Tint": (1.0, 0.5, 0.0)}

    def describes(self, material, dtype):
        return "sheen" in material.extra


@ti.kernel
def _velvet(library: ti.template(), i: int, out: ti.types.ndarray(ndim=1)):
    m = library.get(i)
    out[0], out[1], out[2], out[3], out[4] = m.sheen, m.Tint.x, m.Tint.y, m.Tint.z, m.Ns


def test_parameters_of_a_brdf_come_from_the_file_or_are_its_defaults(precision):
    """Found whatever the letters' case; one number may stand for three."""
    materials = [
        Material(Ns=9, extra={"sheen": (0.75,), "tint": (0.125, 0.25, 0.5)}),
        Material(Ns=8, extra={"sheen": (0.5,), "tint": (2.0,)}),
        Material(Ns=7),
    ]
    library, _owner = library_of(materials, [*SHIPPED, Velvet()])
    expected = [[0.75, 0.125, 0.25, 0.5, 9], [0.5, 2, 2, 2, 8], [0.25, 1, 0.5, 0, 7]]
    for i, row in enumerate(expected):
        out = np.zeros(5, runtime.dtype())
        _velvet(library, i, out)
        np.testing.assert_array_equal(out, row)


def test_one_roughness_and_one_reflectance_are_those_of_all_axes_and_colours():
    short = Material(alpha=0.3, F0=0.9)
    assert short == Material(alpha_x=0.3, alpha_y=0.3, F0=(0.9, 0.9, 0.9))
    assert repr(short) == "Material(alpha_x=0.3, alpha_y=0.3, F0=(0.9, 0.9, 0.9))"
    assert dataclasses.replace(short, Kd=(0, 0, 0)).alpha_x == 0.3
