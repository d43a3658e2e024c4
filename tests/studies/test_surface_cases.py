"""The hard cases of surfaces and of lights at them: they pass, and each finds the mistake that it is about."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import long_except

import taichi_tracer as tt
from taichi_tracer.brdfs.microfacet import Microfacet
from taichi_tracer.lights.spot_light import SpotLight
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


def test_a_quotient_of_microfacets_is_found(monkeypatch):
    monkeypatch.setattr(surface_cases.Microfacets, "brdfs", lambda self: [BySquares()])
    found = surface_cases.Microfacets().judge(EPSILON)
    assert found["nan"] > 0


def test_a_texel_beyond_the_picture_is_found(monkeypatch):
    @ti.func
    def bilinear(self, row, uv):
        return tm.vec3(uv.x - ti.floor(uv.x) + uv.y)

    monkeypatch.setattr(Textures, "bilinear", bilinear)
    assert surface_cases.DegenerateCoordinates().judge(EPSILON)["wrong"] > 0


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
