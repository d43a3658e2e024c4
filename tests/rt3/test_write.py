"""RT3 documents out of scenes: what is written is read again, to the last bit."""

import numpy as np
import pytest
from rt3_text import document, read

from taichi_tracer.rt3.write import as_rt3, tag


def test_what_is_written_is_read_again(tmp_path):
    """Every number to the last bit, through all kinds of content."""
    world = (
        '<background type="4_colors" bl="0.1 0.2 0.3" tl="1 1 1" tr="0 0 0" br="0.7 0.7 0.7"/>'
        '<make_named_material name="a&lt;&amp;&quot;b" type="blinn" diffuse="0.3 0.1 0.7" glossiness="7" Ke="17 12 4"/>'
        '<named_material name="a&lt;&amp;&quot;b"/><rotate angle="33" axis="1 2 3"/>'
        '<object type="sphere" radius="0.3" center="0.1 0.2 0.7"/>'
        '<object type="trianglemesh" vertices="0.1 0 0 1 0.3 0 0 1 0.7 1e-30 1 1e30" indices="0 1 2 1 3 2"'
        ' normals="0 0 1 0 1 0" normal_indices="0 1 -1 1 1 0" backface_cull="yes"/>'
        '<material type="flat" color="0 0.5 1"/><object type="mesh" vertices="0 0 0 1 0 0 0 1 0" indices="0 1 2"/>'
    )
    first = read(tmp_path, document(world, tail='<camera type="perspective" fovy="40.1"/><render_again/>'))
    second = read(tmp_path, as_rt3(first, tmp_path / "again.xml"), "again.xml")
    assert second.mesh.notes == []
    assert second.background == first.background
    assert second.shots == first.shots
    for mesh in (first.mesh, second.mesh):
        mesh.corners = mesh.vertices[mesh.faces]
        mesh.corner_normals = np.where(mesh.face_normals[..., None] < 0, 0, mesh.normals[mesh.face_normals])
    for name in (
        "corners",
        "corner_normals",
        "spheres",
        "sphere_ids",
        "sphere_materials",
        "face_materials",
        "face_culls",
    ):
        np.testing.assert_array_equal(getattr(second.mesh, name), getattr(first.mesh, name), err_msg=name)
    for a, b in zip(first.mesh.materials, second.mesh.materials, strict=True):
        assert a == b


@pytest.mark.parametrize(
    ("attributes", "text"),
    [
        ({"a": 0.1, "b": [1.0, -2.5e-30]}, '<t a="0.1" b="1.0 -2.5e-30"/>'),
        ({"a": None, "b": True, "c": False}, '<t b="yes" c="no"/>'),
        ({"a": 'x<&"y', "b": "\x01"}, '<t a=\'x&lt;&amp;"y\' b="?"/>'),
        ({"a": np.float32(0.1), "b": 7}, f'<t a="{float(np.float32(0.1))!r}" b="7"/>'),
    ],
)
def test_an_element_says_every_number_to_its_last_digit(attributes, text):
    assert tag("t", **attributes) == text


def test_names_tell_materials_apart(tmp_path):
    world = "".join(
        f'<material type="flat" color="{c}"/><object type="sphere" radius="1"/>' for c in ("1 0 0", "0 1 0", "0 0 1")
    )
    first = read(tmp_path, document(world))
    second = read(tmp_path, as_rt3(first, tmp_path / "again.xml"), "again.xml")
    assert len({material.name for material in second.mesh.materials}) == 3
    assert [material.Kd for material in second.mesh.materials] == [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    assert second.mesh.sphere_materials.tolist() == [0, 1, 2]


def test_layered_materials_stay_layered(tmp_path):
    world = '<material type="microfacet" alpha="0.25" F0="0.04 0.04 0.04" Kd="0.5 0.4 0.3" layered="1"/>'
    first = read(tmp_path, document(f'{world}<object type="sphere" radius="1"/>'))
    second = read(tmp_path, as_rt3(first, tmp_path / "again.xml"), "again.xml")
    assert first.mesh.materials[0].extra == {"layered": (1.0,)}
    assert second.mesh.materials == first.mesh.materials
