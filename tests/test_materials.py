"""Materials and textures."""

import dataclasses

import numpy as np
import pytest
import taichi as ti
from oracles import textures as oracle
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.microfacet import Microfacet
from taichi_tracer.brdfs.phong import Mirror, Phong
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material, MaterialLibrary
from taichi_tracer.system import runtime

NOT_NUMBERS = {"Kd": (np.nan, 0, 0), "Ke": (np.inf, 1, 1), "Ks": (1, 2), "F0": ("a", "b", "c"), "Ns": "50", "d": None}


@pytest.mark.parametrize("name", NOT_NUMBERS)
def test_what_is_no_number_of_a_material_is_named(name):
    with pytest.raises(tt.InputError, match=f"Material: {name} must be (a|three) finite number"):
        Material(**{name: NOT_NUMBERS[name]})


def test_colours_may_be_arrays_and_materials_of_a_scene_stay(f32):
    assert Material(Kd=np.array([0.1, 0.2, 0.3])) == Material(Kd=(0.1, 0.2, 0.3))
    with pytest.raises(TypeError, match="does not support item assignment"):
        tt.scene_from_mesh(*SQUARE).materials[0] = Material()


SHIPPED = (Diffuse(), Phong(), Mirror(), Microfacet())


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
    library = MaterialLibrary(made, SHIPPED)
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
    library = MaterialLibrary([Material(Ns=ns)], SHIPPED)
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
    library = MaterialLibrary(materials, [*SHIPPED, Velvet()])
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


# ── textures ──


pytestmark = pytest.mark.usefixtures("f32")

PIXELS = np.random.default_rng(7).random((5, 7, 3))


def looked_up(texture, corners):
    """(9, 9, 3): what a square shows whose corners have these texture coordinates, one colour per pixel."""
    mesh = Mesh(*map(np.array, SQUARE), materials=[tt.Material(Kd=(1, 1, 1), map_Kd=texture)])
    mesh.corner_uv = np.asarray(corners, float)[mesh.faces]
    camera = tt.OrthographicCamera(9, 9, eye=(0, 0, 5), at=(0, 0, 0), up=(0, 1, 0), screen_window=(-1, 1, -1, 1))
    return tt.RT3Renderer(tt.SceneData(mesh), camera=camera).use("flat").render().image()


def coordinates(corners):
    """(9, 9, 2) the texture coordinates of the same pixels: SQUARE has its corners at (±1, ±1)."""
    vertices, corners = np.array(SQUARE[0], float), np.asarray(corners, float)
    centres = (2 * (np.arange(9) + 0.5) / 9 - 1)[::-1]
    x, y = np.meshgrid(centres, centres)  # the camera looks along −z, so that +x is at its left
    solved = np.linalg.lstsq(np.column_stack([vertices[:, :2], np.ones(4)]), corners, rcond=None)[0]
    return np.stack([x, y, np.ones_like(x)], axis=-1) @ solved


@pytest.mark.parametrize("wrap", [("repeat", "clamp"), ("clamp", "mirror"), ("mirror", "repeat")])
@pytest.mark.parametrize("region", [((-3.3, 2.4), 5.1), ((-0.06, 0.93), 0.13)])
def test_texels_are_those_of_the_oracle(wrap, region):
    (low_u, low_v), size = region
    corners = np.array(SQUARE[0], float)[:, :2] * size / 2 + size / 2 + [low_u, low_v]
    found = looked_up(tt.Texture(PIXELS, wrap), corners)
    for row, of_row in zip(found, coordinates(corners), strict=True):
        for color, uv in zip(row, of_row, strict=True):
            np.testing.assert_allclose(color, oracle.bilinear(PIXELS, uv, wrap), atol=2e-5)


@pytest.mark.parametrize("estimator", ["mis"])
def test_the_reflectance_is_that_of_the_texel(estimator):
    """Under light of 1 from everywhere, a matte wall shows Kd times the texel; one without a texture shows Kd."""
    color = np.array([0.9, 0.5, 0.1])
    vertices = np.concatenate([SQUARE[0], SQUARE[0] + [4, 0, 0]])
    faces = np.concatenate([SQUARE[1], SQUARE[1] + 4])
    texture = tt.Texture(np.broadcast_to(color, (2, 2, 3)))
    materials = [tt.Material(Kd=(0.5, 0.5, 0.5), map_Kd=texture), tt.Material(Kd=(0.25, 0.5, 0.75))]
    uv, ids = vertices[:, :2], [0, 0, 1, 1]
    scene = tt.scene_from_mesh(vertices, faces, material=materials, face_materials=ids, uv=uv, environment="white")
    kind = tt.A4Renderer if estimator == "path" else tt.A2Renderer
    for x, expected in ((0, color / 2), (4, [0.25, 0.5, 0.75])):
        camera = tt.Camera(8, 8, eye=(x, 0, 5), at=(x, 0, 0), up=(0, 1, 0), fov=1)
        image = kind(scene, camera=camera).use(estimator).render(256 if estimator == "uniform" else 8).image()
        np.testing.assert_allclose(image.mean(axis=(0, 1)), expected, rtol=0.02)


@pytest.mark.parametrize("has_texture", [False, True])
def test_colours_of_vertices_are_between_those_of_the_corners(has_texture):
    """Times the texture, if there is one, too."""
    colors = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0.5]])
    mesh = Mesh(*map(np.array, SQUARE), materials=[tt.Material(Kd=(1, 1, 1))])
    mesh.corner_color = colors[mesh.faces]
    factor = 1.0
    if has_texture:
        mesh.materials = [tt.Material(Kd=(1, 1, 1), map_Kd=tt.Texture(PIXELS[:1, :1]))]
        mesh.corner_uv, factor = np.zeros((2, 3, 2)), PIXELS[0, 0]
    scene = tt.SceneData(mesh)
    camera = tt.OrthographicCamera(9, 9, eye=(0, 0, 5), at=(0, 0, 0), up=(0, 1, 0), screen_window=(-1, 1, -1, 1))
    image = tt.RT3Renderer(scene, camera=camera).use("flat").render().image()
    hits = scene.intersect(*camera.rays(*np.meshgrid(np.arange(9), np.arange(9)[::-1])))
    u, v = np.asarray(hits.barycentric_coords, float).T
    weights = np.stack([1 - u - v, u, v], axis=-1)
    expected = (weights[:, :, None] * mesh.corner_color[hits.triangle_id]).sum(axis=1) * factor
    np.testing.assert_allclose(image.reshape(-1, 3), expected, atol=1e-5)


def test_a_sphere_is_covered_once():
    """Its longitude is u and its latitude v, as in its barycentric coordinates."""
    mesh = Mesh(np.zeros((0, 3)), np.zeros((0, 3), int), spheres=np.array([[0, 0, 0, 1.0]]))
    mesh.materials, mesh.corner_uv = [tt.Material(Kd=(1, 1, 1), map_Kd=tt.Texture(PIXELS))], np.zeros((0, 3, 2))
    scene = tt.SceneData(mesh)
    camera = tt.Camera(5, 5, eye=(3, 1, 2), at=(0, 0, 0))
    image = tt.RT3Renderer(scene, camera=camera).use("flat").render().image()
    hits = scene.intersect([3, 1, 2], [-3, -1, -2])
    np.testing.assert_allclose(
        image[2, 2], oracle.bilinear(PIXELS, hits.barycentric_coords[0], ("repeat",) * 2), atol=1e-4
    )
