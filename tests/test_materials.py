"""Materials reach kernels with the values that the file has."""

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.materials import Material, as_table


@ti.kernel
def _read(library: ti.template(), i: int, out: ti.types.ndarray(ndim=1)):
    m = library.get(i)
    for k in ti.static(range(3)):
        out[k], out[3 + k], out[6 + k], out[9 + k], out[12 + k] = m.Kd[k], m.Ka[k], m.Ks[k], m.Ke[k], m.F0[k]
    out[15], out[16], out[17], out[18], out[19] = m.Ns, m.Ni, m.d, m.alpha_x, m.alpha_y


def test_every_value_arrives_under_its_own_name(precision, rng):
    from taichi_tracer.system import runtime

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
    scene = _scene(made)
    for i, m in enumerate(made):
        out = np.zeros(20, runtime.dtype())
        _read(scene.material_library, i, out)
        expected = np.concatenate([m.Kd, m.Ka, m.Ks, m.Ke, m.F0, [m.Ns, m.Ni, m.d, m.alpha_x, m.alpha_y]])
        np.testing.assert_array_equal(out, expected.astype(runtime.dtype()))


def _scene(materials):
    from taichi_tracer.geometry import Mesh

    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]), materials=materials)
    return tt.SceneData(mesh)


def test_defaults_are_those_of_the_format():
    material = Material()
    assert (material.Ns, material.Ni, material.d) == (1, 1, 1)
    assert material.Ke == (0, 0, 0)
    assert as_table([material]).shape == (1, 20)


def test_huge_exponents_survive(f32):
    """Ns = 1e21 of the course's mirror is finite in f32."""
    out = np.zeros(20, np.float32)
    scene = _scene([Material(Ns=1e21)])
    _read(scene.material_library, 0, out)
    assert out[15] == np.float32(1e21)
