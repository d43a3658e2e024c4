"""The raw arrays ``uv`` and ``albedo``: what surfaces look like without light, against look-ups in float64."""

import numpy as np
import pytest
from oracles import textures as oracle
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh

PIXELS = np.random.default_rng(7).random((5, 7, 3))
SIZE = 9


def renderer_of(kind=tt.A1Renderer, **arrays):
    """A renderer that sees a square, and nothing around it, through parallel rays."""
    vertices, faces = map(np.array, SQUARE)
    plain = {"vertices": vertices, "faces": faces, "materials": [tt.Material(Kd=(0.5, 0.25, 1))]}
    mesh = Mesh(**(plain | arrays))
    window = (-1.5, 1.5, -1.5, 1.5)
    camera = tt.OrthographicCamera(SIZE, SIZE, eye=(0, 0, 5), at=(0, 0, 0), up=(0, 1, 0), screen_window=window)
    return kind(tt.SceneData(mesh), camera=camera)


def textured(corners, **arrays):
    """The arrays of a mesh whose square has a picture, with these texture coordinates of its corners."""
    material = tt.Material(Kd=(0.5, 0.25, 1), map_Kd=tt.Texture(PIXELS))
    return {"materials": [material], "corner_uv": corners[np.array(SQUARE[1])], **arrays}


def test_a_texture_is_looked_up_where_uv_says(precision):
    """Far from the origin, too: uv is not only its fractional part."""
    corners = np.array(SQUARE[0], float)[:, :2] * 3.3 + [11.05, -4.1]
    renderer = renderer_of(**textured(corners))
    uv, albedo, position = (renderer.aov(name) for name in ("uv", "albedo", "position"))
    is_hit = renderer.aov("triangle_id") >= 0
    assert 0 < is_hit.sum() < SIZE**2
    for array in (uv, albedo):
        assert array.dtype == {"f32": np.float32, "f64": np.float64}[precision]
        assert np.isnan(array[~is_hit]).all()
    np.testing.assert_allclose(uv[is_hit], position[is_hit][:, :2] * 3.3 + [11.05, -4.1], atol=1e-5)
    expected = [oracle.bilinear(PIXELS, at, ("repeat", "repeat")) * [0.5, 0.25, 1] for at in uv[is_hit]]
    np.testing.assert_allclose(albedo[is_hit], expected, atol=2e-5)


@pytest.mark.usefixtures("f32")
def test_a_sphere_has_them_too():
    """Its longitude and its latitude."""
    sphere = {"vertices": np.zeros((0, 3)), "faces": np.zeros((0, 3), int), "spheres": np.array([[0, 0, 0, 1.0]])}
    material = tt.Material(Kd=(1, 1, 1), map_Kd=tt.Texture(PIXELS))
    renderer = renderer_of(**sphere, materials=[material], corner_uv=np.zeros((0, 3, 2)))
    is_hit = renderer.aov("triangle_id") >= 0
    np.testing.assert_allclose(renderer.aov("uv")[is_hit], renderer.aov("barycentric")[is_hit], atol=1e-6)
    expected = [oracle.bilinear(PIXELS, at, ("repeat", "repeat")) for at in renderer.aov("uv")[is_hit]]
    np.testing.assert_allclose(renderer.aov("albedo")[is_hit], expected, atol=1e-4)
