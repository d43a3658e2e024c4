"""The hard cases of surfaces and of lights at them: they pass, and each finds the mistake that it is about."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import long_except

import taichi_tracer as tt
from taichi_tracer.brdfs import rough_layer
from taichi_tracer.brdfs.microfacet import Microfacet, alphas, distribution, in_frame, scaled_length
from taichi_tracer.brdfs.rough_layer import RoughLayer
from taichi_tracer.lights.spot_light import SpotLight
from taichi_tracer.scene_in_kernels import SceneInKernels
from taichi_tracer.studies.hard import surface_cases
from taichi_tracer.studies.hard.catalogue import all_renderer_cases
from taichi_tracer.textures import Textures

EPSILON = 2.0**-23

pytestmark = pytest.mark.usefixtures("f32")


QUICK = [case for case in surface_cases.SURFACES if case is not surface_cases.LightInside][:2]


@pytest.mark.parametrize("case", long_except(surface_cases.SURFACES, *QUICK))
def test_it_passes(case):
    found = case().judge(EPSILON)
    assert found["tried"] > 100
    assert (found["wrong"], found["nan"]) == (0, 0)


def test_the_suite_tries_them():
    assert set(surface_cases.SURFACES) <= {type(case) for case in all_renderer_cases(("brdf",))}


@ti.data_oriented
class BySquares(Microfacet):
    """The weight as a quotient of rounded numbers."""

    def describes(self, material, dtype):
        return material.is_rough

    @ti.func
    def weight(self, material, w_o, w_i, n):
        cosine = ti.max(0.0, tm.dot(n, w_i))
        return self.eval(material, w_o, w_i, n) * cosine / self.pdf(material, w_o, w_i, n)


@ti.data_oriented
class WithRoundedCosine(Microfacet):
    """The density is 0 where the rounded ω_o·ω_m is not above 0."""

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        value = 0.0
        alpha, o, i = alphas(material), in_frame(w_o, n), in_frame(w_i, n)
        if o.z > 0 and (o + i).norm_sqr() > 0:
            m = tm.normalize(o + i)
            if m.z > 0 and tm.dot(o, m) > 0:
                value = distribution(alpha, m) / (2 * (o.z + scaled_length(alpha, o)))
        return value


def test_a_quotient_of_microfacets_is_found(monkeypatch):
    monkeypatch.setattr(surface_cases.Microfacets, "brdfs", lambda self: [BySquares()])
    found = surface_cases.Microfacets().judge(EPSILON)
    assert found["nan"] > 0


@pytest.mark.long
def test_a_density_that_is_0_where_there_is_light_is_found(monkeypatch):
    monkeypatch.setattr(rough_layer, "LAYER", WithRoundedCosine())
    monkeypatch.setattr(surface_cases.RoughLayers, "brdfs", lambda self: [RoughLayer()])
    monkeypatch.setattr(surface_cases.RoughLayers, "xis", surface_cases.RoughLayers.grid)
    found = surface_cases.RoughLayers().judge(EPSILON)
    assert found["wrong"] > 0
    assert found["energy"] > 1e3


def test_a_texel_beyond_the_picture_is_found(monkeypatch):
    @ti.func
    def bilinear(self, row, uv):
        return tm.vec3(uv.x - ti.floor(uv.x) + uv.y)

    monkeypatch.setattr(Textures, "bilinear", bilinear)
    assert surface_cases.DegenerateCoordinates().judge(EPSILON)["wrong"] > 0


@pytest.mark.long
def test_light_that_gets_out_is_found(monkeypatch):
    @ti.func
    def is_blocked(self, surface, w_i, distance):
        return False

    monkeypatch.setattr(SceneInKernels, "is_blocked", is_blocked)
    assert surface_cases.LightInside().judge(EPSILON)["wrong"] > 0


def test_a_cone_that_divides_by_its_edge_is_found(monkeypatch):
    @ti.func
    def share(self, theta):
        return ti.max((self.cutoff - theta) / (self.cutoff - self.falloff), 0.0)

    monkeypatch.setattr(SpotLight, "share", share)
    assert surface_cases.SpotAngles().judge(EPSILON)["wrong"] > 0


def test_coordinates_that_are_no_numbers_are_told(tmp_path):
    """Refused from Python; a file is read, and says for how many triangles."""
    corners = np.eye(3)
    with pytest.raises(tt.InputError, match="mesh: uv must be finite numbers, not nan"):
        tt.scene_from_mesh(corners, [[0, 1, 2]], uv=[[0, 0], [0, np.nan], [1, 1]])
    tt.save_image(tmp_path / "t.png", np.ones((2, 2, 3)))
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd t.png\n")
    vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    for word, notes in (("nan", ["1 triangles have texture coordinates that are not finite numbers"]), ("2.5", [])):
        faces = f"vt {word} 0\nf 1/1 2/1 3/1\n"
        (tmp_path / "a.obj").write_text(f"mtllib a.mtl\nusemtl m\n{vertices}{faces}")
        scene = tt.load_scene_data(tmp_path / "a.obj")
        assert [note.split("a.obj: ")[1] for note in scene.notes] == notes
