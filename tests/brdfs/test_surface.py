"""A surface asks the BRDF of its material, starts rays off itself, and looks to the viewer's side."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import light
from probe import put, vec3
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.phong import Mirror, Phong
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.ray import Ray
from taichi_tracer.system import runtime

NUMBERS = 29


@ti.kernel
def _ask(
    scene: ti.template(),
    origins: ti.types.ndarray(ndim=2),
    directions: ti.types.ndarray(ndim=2),
    incoming: ti.types.ndarray(ndim=2),
    out: ti.types.ndarray(ndim=2),
):
    for i in range(origins.shape[0]):
        ray = Ray(origin=vec3(origins, i, 0), direction=vec3(directions, i, 0))
        hit = scene.ray_intersector.query_ray(ray)
        surface = scene.surface_at(ray, hit)
        w_i, xi = vec3(incoming, i, 0), tm.vec2(0.3, 0.7)
        put(out, i, 0, surface.eval(w_i))
        out[i, 3] = surface.pdf(w_i)
        put(out, i, 4, surface.sample(xi))
        put(out, i, 7, surface.weight(w_i))
        put(out, i, 10, surface.eval_cosine(w_i))
        put(out, i, 13, surface.origin)
        put(out, i, 16, surface.normal)
        put(out, i, 19, surface.geometric_normal)
        put(out, i, 22, surface.w_o)
        out[i, 25] = ti.cast(surface.is_delta(), ti.i32)
        put(out, i, 26, surface.material.Kd)


@ti.kernel
def _ask_brdf(
    brdf: ti.template(),
    library: ti.template(),
    material_id: int,
    w_o: tm.vec3,
    w_i: tm.vec3,
    n: tm.vec3,
    out: ti.types.ndarray(ndim=1),
):
    for _ in range(1):
        m = library.get(material_id)
        f, w, s = brdf.eval(m, w_o, w_i, n), brdf.weight(m, w_o, w_i, n), brdf.sample(m, w_o, n, tm.vec2(0.3, 0.7))
        out[3] = brdf.pdf(m, w_o, w_i, n)
        for k in ti.static(range(3)):
            out[k], out[4 + k], out[7 + k] = f[k], s[k], w[k]


MATERIALS = [
    Material("matte", Kd=(0.8, 0.5, 0.2)),
    Material("glossy", Kd=(0.1, 0.9, 0.4), Ns=12.0),
    Material("mirror", Kd=(0.7, 0.7, 0.9), Ns=1e36),
]


def three_squares(materials=MATERIALS):
    """A square for each material, 4 units apart along x, facing +z."""
    vertices, faces = SQUARE
    count = len(materials)
    return Mesh(
        np.concatenate([vertices + [4 * k, 0, 0] for k in range(count)]),
        np.concatenate([faces + 4 * k for k in range(count)]),
        face_materials=np.repeat(np.arange(count, dtype=np.int32), 2),
        materials=list(materials),
    )


def asked(scene, origins, directions, incoming):
    dtype = runtime.dtype()
    out = np.zeros((len(origins), NUMBERS), dtype)
    _ask(scene.in_kernels(), *(np.ascontiguousarray(a, dtype) for a in (origins, directions, incoming)), out)
    return out


def test_each_material_is_reflected_by_its_own_brdf(precision, rng):
    """All numbers are those of the BRDF itself, asked without a surface."""
    scene = tt.SceneData(three_squares())
    places = np.array([[0.3, 0.1, 0], [4.3, 0.1, 0], [8.3, 0.1, 0]])
    w_o, w_i = light.to_unit(np.array([0.3, -0.4, 0.9])), light.hemisphere(rng, 3)
    found = asked(scene, places + 2 * w_o, np.tile(-w_o, (3, 1)), w_i)
    np.testing.assert_allclose(found[:, 26:29], [m.Kd for m in MATERIALS], rtol=1e-6)
    np.testing.assert_array_equal(found[:, 25], [0, 0, 1])
    for k, brdf in enumerate((Diffuse(), Phong(), Mirror())):
        expected = np.zeros(10, runtime.dtype())
        _ask_brdf(
            brdf, scene.material_library, k, ti.Vector(found[k, 22:25]), ti.Vector(w_i[k]), tm.vec3(0, 0, 1), expected
        )
        np.testing.assert_array_equal(found[k, :10], expected)
        np.testing.assert_allclose(found[k, 10:13], expected[:3] * w_i[k, 2], rtol=1e-5)


@pytest.mark.parametrize("side", [1, -1])
def test_it_looks_to_the_viewer_and_its_rays_start_off_it(precision, side):
    """Both normals on the viewer's side; the origin beyond the plane by less than a few roundings."""
    scene = tt.SceneData(three_squares())
    found = asked(scene, [[4.2, 0.3, 2 * side]], [[0, 0, -side]], [[0, 0, side]])[0]
    np.testing.assert_array_equal(found[16:19], [0, 0, side])
    np.testing.assert_array_equal(found[19:22], [0, 0, side])
    np.testing.assert_array_equal(found[22:25], [0, 0, side])
    np.testing.assert_allclose(found[13:15], [4.2, 0.3], rtol=1e-6)
    assert 0 < side * found[15] < 100 * runtime.epsilon()


def test_a_scene_with_one_brdf_compiles_no_decision(f32):
    """Nothing asks which BRDF a material has: the id is never read, though the material says another one."""
    scene = tt.SceneData(three_squares(MATERIALS[:1]))
    scene.material_library.brdf_ids[0, 0] = 17
    found = asked(scene, [[0.1, 0.2, 1]], [[0, 0, -1]], [[0, 0, 1]])[0]
    np.testing.assert_allclose(found[:3], np.array(MATERIALS[0].Kd) / np.pi, rtol=1e-6)


def test_brdfs_that_were_given_to_the_scene_are_asked_first(f32):
    @ti.data_oriented
    class Constant(Brdf):
        name = "constant"

        def describes(self, material, dtype):
            return material.name == "glossy"

        @ti.func
        def eval(self, material, w_o, w_i, n):
            return tm.vec3(5, 6, 7)

        @ti.func
        def pdf(self, material, w_o, w_i, n):
            return 1.0

        @ti.func
        def sample(self, material, w_o, n, xi):
            return n

    scene = tt.SceneData(three_squares(), brdfs=[Constant()])
    found = asked(scene, [[0.1, 0.2, 1], [4.1, 0.2, 1]], [[0, 0, -1]] * 2, [[0, 0, 1]] * 2)
    np.testing.assert_allclose(found[0, :3], np.array(MATERIALS[0].Kd) / np.pi, rtol=1e-6)
    np.testing.assert_array_equal(found[1, :3], [5, 6, 7])
