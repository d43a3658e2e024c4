"""From a name or a path to a scene, and what is said when there is none."""

import numpy as np
import pytest
from rt3_text import document
from shapes import sphere

import taichi_tracer as tt
from taichi_tracer.scene_data_loader import OWN_VIEWS

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("name", ["cornell_box", "cube"])
def test_every_shipped_scene_loads_with_its_own_view_or_from_above(name):
    scene = tt.load_scene_data(name)
    assert scene.num_triangles > 0
    assert scene.dropped == 0
    if name in OWN_VIEWS:
        assert scene.view == OWN_VIEWS[name]
    else:
        assert (scene.view["eye"] - scene.view["at"] > 0.5).all()
    scene.destroy()


def test_shipped_gltf_files_are_shown_as_they_say():
    """Metals and layers; and a globe whose north is white, above tiles of two colours."""
    spheres = tt.load_scene_data("ggx_spheres")
    assert (spheres.num_triangles, spheres.notes) == (18 * 512, [])
    assert {spheres.material_library.brdfs[i].name for i in spheres.effects.brdfs} == {"microfacet", "layered"}
    globe = tt.load_scene_data("globe")
    assert (globe.num_triangles, globe.notes, globe.effects.textures) == (530, [], True)
    renderer = tt.A1Renderer(globe, 40, 30)
    albedo, uv, normal = (renderer.aov(name) for name in ("albedo", "uv", "normal"))
    is_globe = renderer.aov("material_id") == 0
    north = is_globe & (normal[..., 1] > 0.93)
    assert north.any()
    assert albedo[north].min() > 0.7
    np.testing.assert_allclose(np.cos(np.pi * (1 - uv[is_globe][:, 1])), normal[is_globe][:, 1], atol=0.06)
    assert uv[renderer.aov("material_id") == 1].max() > 4


def test_a_path_is_a_scene_framed_by_its_box(tmp_path):
    path = tmp_path / "two words.obj"
    path.write_text("v 10 0 0\nv 12 0 0\nv 10 2 0\nf 1 2 3\n")
    scene = tt.load_scene_data(path)
    assert scene.intersect([10.5, 0.5, 1], [0, 0, -1]).is_hit[0]
    assert list(scene.view["at"]) == [11, 1, 0]
    renderer = tt.A1Renderer(scene_data=scene, width=16, height=16)
    assert renderer.use("hit").image().max() == 1


def test_a_file_says_what_is_around_it_unless_the_caller_does(tmp_path):
    np.save(tmp_path / "sky.npy", np.ones((2, 4, 3), np.float32))
    sky = '<background type="spherical" filename="sky.npy"/>'
    (tmp_path / "scene.xml").write_text(document(sky, tail='<integrator type="flat"/>'))
    path = tmp_path / "scene.xml"
    assert tt.load_scene_data(path).environment.name == str(tmp_path / "sky.npy")
    assert tt.load_scene_data(path, environment=None).environment is None
    assert tt.load_scene_data(path, environment="white").environment.name == "white"
    assert tt.load_scene_data("cube").environment is None  # a mesh says nothing


def test_a_trimesh_is_a_scene_too():
    import trimesh

    vertices, faces = sphere()
    by_arrays = tt.scene_from_mesh(vertices, faces).intersect([0, 0, 3], [0.1, 0.05, -1])
    by_trimesh = tt.scene_from_mesh(trimesh.Trimesh(vertices, faces, process=False)).intersect(
        [0, 0, 3], [0.1, 0.05, -1]
    )
    assert by_arrays.triangle_id[0] == by_trimesh.triangle_id[0]
    assert by_arrays.distance[0] == by_trimesh.distance[0]
