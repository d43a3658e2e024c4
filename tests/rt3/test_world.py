"""The world of an RT3 document: objects in their order, with the transform and the material that are in force."""

import numpy as np
import pytest
from rt3_text import document, read

from taichi_tracer.rt3.world import rotation
from taichi_tracer.system.errors import InputError


def test_ids_are_in_the_order_of_the_document(tmp_path):
    """Spheres and triangles in turn; materials by first use (C-16)."""
    triangle = '<object type="trianglemesh" vertices="0 0 0 1 0 0 0 1 0 1 1 0" indices="0 1 2 1 3 2" material="{}"/>'
    world = (
        '<make_named_material name="unused" type="matte"/><make_named_material name="b" type="matte" diffuse="0 0 1"/>'
        '<make_named_material name="a" type="blinn" diffuse="1 0 0" specular="1 1 1" glossiness="64"/>'
        f'<named_material name="a"/><object type="sphere" radius="2"/>{triangle.format("b")}'
        f'<object type="sphere" radius="3" material="b"/>{triangle.format("a")}'
    )
    mesh = read(tmp_path, document(world)).mesh
    assert mesh.sphere_ids.tolist() == [0, 3]
    assert mesh.primitives().tolist() == [-1, 0, 1, -2, 2, 3]
    assert mesh.spheres[:, 3].tolist() == [2, 3]
    assert [m.name for m in mesh.materials] == ["a", "b"]
    assert mesh.face_materials.tolist() == [1, 1, 0, 0]
    assert mesh.sphere_materials.tolist() == [0, 1]
    assert mesh.materials[0].Ns == 64
    corners = mesh.vertices[mesh.faces]
    np.testing.assert_array_equal(corners[:2], corners[2:])
    np.testing.assert_array_equal(corners[1], [[1, 0, 0], [1, 1, 0], [0, 1, 0]])


def test_transforms_are_applied_from_the_object_outwards(tmp_path):
    """translate, rotate, scale as the last is nearest to the object; push and pop; named systems."""
    point = '<object type="sphere" radius="1" center="1 0 0"/>'
    world = (
        f'<push_CTM/><translate value="10 0 0"/><rotate axis="0 0 2" angle="90"/><scale value="2 2 2"/>{point}'
        f'<save_coord_system name="s"/><pop_CTM/>{point}<restore_coord_system name="s"/>{point}<identity/>{point}'
        f'<push_GS/><material type="flat" color="1 0 0"/><scale value="-1 1 1"/>{point}<pop_GS/>{point}'
    )
    mesh = read(tmp_path, document(world)).mesh
    turned = [10, 2, 0, 2]
    expected = [turned, [1, 0, 0, 1], turned, [1, 0, 0, 1], [-1, 0, 0, 1], [1, 0, 0, 1]]
    np.testing.assert_allclose(mesh.spheres, expected, atol=1e-12)
    assert mesh.sphere_materials.tolist() == [0, 0, 0, 0, 1, 0]


def test_meshes_are_turned_mirrored_and_their_normals_with_them(tmp_path):
    head = '<object type="trianglemesh" vertices="0 0 0 1 0 0 0 1 0" indices="0 1 2" normals="0 0 1 0 0 1 0 0 1"'
    world = f'<scale value="2 1 -0.5"/>{head}/>{head} reverse_vertex_order="yes"/>{head} compute_normals="on"/>'
    mesh = read(tmp_path, document(world)).mesh
    corners = mesh.vertices[mesh.faces]
    geometric = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.sign(geometric[:, 2]).tolist() == [-1, 1, -1]  # the mirror keeps fronts in front
    shading = mesh.normals[mesh.face_normals][:, 0]
    assert np.sign(shading[:, 2]).tolist() == [-1, -1, -1]


def test_meshes_come_from_files_beside_the_document(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "t.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "parts" / "world.xml").write_text(
        '<any><object type="mesh" filename="t.obj" backface_cull="on"/></any>'
    )
    mesh = read(tmp_path, document('<include filename="parts/world.xml"/><include filename="parts/world.xml"/>')).mesh
    assert len(mesh.faces) == 2
    assert mesh.face_culls.all()


# ── the formulas ──


def test_a_rotation_is_counter_clockwise_seen_from_its_tip(rng):
    np.testing.assert_allclose(rotation(np.pi / 2, np.array([0, 0, 1.0])) @ [1, 0, 0], [0, 1, 0], atol=1e-15)
    axis = np.array([1.0, -2.0, 2.0]) / 3
    turn = rotation(0.7, axis)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(turn @ axis, axis, atol=1e-15)
    assert np.linalg.det(turn) == pytest.approx(1)
    np.testing.assert_allclose(rotation(0.3, axis) @ rotation(0.4, axis), turn, atol=1e-15)


def test_microfacets_have_a_roughness_and_a_reflectance(tmp_path):
    def material(words):
        text = f'<material type="microfacet" {words}/><object type="sphere" radius="1"/>'
        return read(tmp_path, document(text)).mesh.materials[0]

    one = material('alpha="0.3" F0="0.9 0.6 0.3"')
    assert (one.alpha_x, one.alpha_y, one.F0) == (0.3, 0.3, (0.9, 0.6, 0.3))
    two = material('alpha_x="0.1" alpha_y="0.4" specular="0.5 0.5 0.5"')
    assert (two.alpha_x, two.alpha_y, two.F0) == (0.1, 0.4, (0.5, 0.5, 0.5))
    with pytest.raises(InputError, match=r":6: .*microfacet material needs alpha"):
        material('F0="1 1 1"')
