"""--parts in every command: parts of a file of one's own, files that are wrong, and --plain."""

import pytest

from taichi_tracer.apps.cli import main
from taichi_tracer.system.parts import PARTS

PARTS_FILE = '''
import taichi as ti
import taichi.math as tm
import taichi_tracer as tt


@tt.register
class Heat(tt.View):
    name, label = "heat", "Heat"

    @ti.func
    def color(self, hit):
        return tm.vec3(1, 0, 0) * hit.distance / 5


@tt.register
class Mine(tt.RayIntersector):
    """The handout's: nothing but intersect_triangle."""

    name = "mine"

    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        hit = tt.HitData()
        ids = self.geometry.triangle_vertex_ids[triangle_id]
        v0 = self.geometry.vertices[ids[0]]
        v1 = self.geometry.vertices[ids[1]]
        v2 = self.geometry.vertices[ids[2]]
        e1, e2, s = v1 - v0, v2 - v0, ray.origin - v0
        det = tm.dot(e1, tm.cross(ray.direction, e2))
        u = tm.dot(s, tm.cross(ray.direction, e2)) / det
        v = tm.dot(ray.direction, tm.cross(s, e1)) / det
        t = tm.dot(e2, tm.cross(s, e1)) / det
        if u >= 0 and v >= 0 and u + v <= 1 and t > self.EPSILON:
            hit.is_hit = 1
            hit.triangle_id = triangle_id
            hit.distance = t
            hit.barycentric_coords = tm.vec2(u, v)
            hit.normal = tm.vec3(0.6, 0, 0.8)  # wrong, so that every picture shows it
            hit.material_id = self.geometry.triangle_material_ids[triangle_id]
        return hit


@ti.func
def doubled_t(o, d, v0, v1, v2):
    e1, e2, s = v1 - v0, v2 - v0, o - v0
    det = tm.dot(e1, tm.cross(d, e2))
    u, v = tm.dot(s, tm.cross(d, e2)) / det, tm.dot(d, tm.cross(s, e1)) / det
    return u >= 0 and v >= 0 and u + v <= 0.5, tm.dot(e2, tm.cross(s, e1)) / det, u, v, det


tt.register(tt.TriangleTest("half_triangles", doubled_t))


@tt.register
class Grey(tt.Brdf):
    name = "grey"

    def describes(self, material, dtype):
        return material.Ns <= 1

    @ti.func
    def eval(self, material, w_o, w_i, n):
        return tm.vec3(0.5 / tm.pi)

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        return 1 / (4 * tm.pi)

    @ti.func
    def sample(self, material, w_o, n, xi):
        z = 1 - 2 * xi.x
        r, phi = ti.sqrt(ti.max(0.0, 1 - z * z)), 2 * tm.pi * xi.y
        return tm.vec3(r * tm.cos(phi), r * tm.sin(phi), z)


@tt.register
class Still(tt.Sampler):
    name = "still"

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        return tm.vec2(0.25, 0.75)


@tt.register
class Fisheye(tt.Camera):
    name = "fisheye"

    @ti.func
    def generate_camera_coords(self, ndc_coords):
        r = ndc_coords.norm()
        return tm.vec4(ndc_coords * ti.sin(r) / ti.max(r, 1e-6), ti.cos(r), 0)


@tt.register
class Twice(tt.DirectLight):
    name, label = "twice", "Twice the light"

    @ti.func
    def sample(self, scene, surface, xi):
        w_i = surface.sample(xi)
        return w_i, 2 * surface.weight(w_i)


@tt.register
class Lamp(tt.Light):
    name, is_delta = "lamp", True

    @ti.func
    def sample(self, x, xi):
        to_lamp = tm.vec3(0, 1.8, 2) - x
        return to_lamp.normalized(), to_lamp.norm(), tm.vec3(4) / to_lamp.norm_sqr(), 1.0
'''
NAMES = ("heat", "mine", "half_triangles", "grey", "still", "fisheye", "twice", "lamp")


@pytest.fixture(autouse=True)
def _forget(tmp_path):
    """What the files of a test registered is forgotten at its end."""
    yield
    for file in tmp_path.rglob("*.py"):
        for part in PARTS.registered_by(file):
            PARTS.remove(part)


@pytest.fixture
def parts(tmp_path, monkeypatch):
    """``--parts`` with a file of parts of every kind, in the folder where the test works."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_parts.py").write_text(PARTS_FILE)
    return ["--parts", "my_parts.py"]


# ── every command ──


@pytest.mark.parametrize(
    ("command", "shown"),
    [
        ("render", NAMES),
        ("view", NAMES),
        ("info", NAMES),
        ("export", ("heat", "still", "fisheye", "twice")),
        ("effects", tuple(name for name in NAMES if name != "heat")),
        ("accuracy", tuple(name for name in NAMES if name != "heat")),
    ],
)
def test_a_help_lists_the_names_of_the_file_with_the_others(command, shown, parts, capsys):
    with pytest.raises(SystemExit) as end:
        main([command, "--help", *parts])
    assert end.value.code == 0
    words = capsys.readouterr().out.replace("*", "").replace(",", "").split()
    assert [name for name in shown if name not in words] == []
