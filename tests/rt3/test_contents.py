"""Instances of RT3: what is defined, where it is called, what is wrong with either; and what is written again."""

import numpy as np
import pytest
from rt3_text import document, read
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Instances, group, resolve_instances
from taichi_tracer.rt3.document import Document, FilmSettings, IntegratorSettings, Shot
from taichi_tracer.rt3.write import as_rt3

TRIANGLE = '<object type="trianglemesh" vertices="0 0 0 1 0 0 0 1 0" indices="0 1 2"/>'
LEAF = f'<object_instance_begin name="leaf"/>\n{TRIANGLE}\n<object_instance_end/>'
CALL = '<object_instance_call name="leaf"/>'


def corners(found):
    """(n, 3, 3) the corners of all triangles in all places."""
    flat = resolve_instances(found.mesh, choice="copied")
    return flat.vertices[flat.faces]


def test_an_instance_appears_where_it_is_called_and_nowhere_else(tmp_path):
    world = f"""{LEAF}
        <translate value="5 0 0"/>\n{CALL}\n<scale value="2"/>\n{CALL}"""
    found = corners(read(tmp_path, document(world)))
    np.testing.assert_array_equal(found, [[[5, 0, 0], [6, 0, 0], [5, 1, 0]], [[5, 0, 0], [7, 0, 0], [5, 2, 0]]])
    assert len(corners(read(tmp_path, document(LEAF + TRIANGLE)))) == 1


def test_a_transform_within_an_instance_comes_first_and_ends_with_it(tmp_path):
    world = f"""<object_instance_begin name="leaf"/>
        <translate value="0 0 3"/>\n<material type="matte" color="1 0 0"/>\n{TRIANGLE}\n<object_instance_end/>
        <scale value="10 1 1"/>\n{CALL}\n<identity/>\n{TRIANGLE}"""
    found = read(tmp_path, document(world))
    np.testing.assert_array_equal(corners(found)[:, 1], [[1, 0, 0], [10, 0, 3]])
    flat = resolve_instances(found.mesh, choice="copied")
    assert [flat.materials[i].Kd for i in flat.face_materials][1] == (1.0, 0.0, 0.0)
    assert flat.materials[flat.face_materials[0]].Kd != (1.0, 0.0, 0.0)


def test_instances_are_called_within_others_three_levels_deep(tmp_path):
    world = LEAF
    for name, called in (("branch", "leaf"), ("tree", "branch"), ("wood", "tree")):
        world += f"""<object_instance_begin name="{name}"/>
            <object_instance_call name="{called}"/>\n<translate value="1 0 0"/>
            <rotate angle="90" axis="0 0 1"/>\n<object_instance_call name="{called}"/>\n<object_instance_end/>\n"""
    found = read(tmp_path, document(world + '<object_instance_call name="wood"/>'))
    turn = np.array([[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    expected = [np.eye(4)]
    for _ in range(3):
        expected = [m for one in expected for m in (one, one @ turn)]
    origins = sorted((m[:3, 3].round(9) + 0.0).tolist() for m in expected)
    assert sorted((one[0].round(9) + 0.0).tolist() for one in corners(found)) == origins


def test_a_sphere_may_become_an_ellipsoid(tmp_path):
    found = read(tmp_path, document('<scale value="1 2 1"/>\n<object type="sphere" radius="1"/>'))
    scene = tt.scene_from_mesh(found.mesh)
    assert scene.num_spheres == 1
    hits = scene.intersect([[0, 9, 0], [9, 0, 0]], [[0, -1, 0], [-1, 0, 0]])
    np.testing.assert_allclose(hits.distance, [7, 8], rtol=1e-6)


def test_list_and_ellipsoids_do_not_fit_together(tmp_path):
    path = tmp_path / "a.xml"
    path.write_text(
        document('<scale value="1 2 1"/>\n<object type="sphere" radius="1"/>').replace(
            "<world_begin/>", '<aggregator type="list"/>\n<world_begin/>'
        )
    )
    with pytest.raises(tt.InputError, match="would become an ellipsoid, which only the package's own bvh knows"):
        tt.load_scene_data(path)


@pytest.mark.parametrize(
    ("world", "told"),
    [
        (CALL, r":6: <object_instance_call> name: .*leaf"),
        (LEAF + "\n" + CALL.replace("leaf", "lief"), r":9: <object_instance_call> name: .*lief.*leaf"),
        ("<object_instance_end/>", ":6: <object_instance_end> has no object_instance_begin before it"),
        ('<object_instance_begin name="a"/>', ":7: <world_end> stands in the instance 'a', which began at .*:6"),
        ('<object_instance_begin name="a"/>\n' + LEAF, ":7: <object_instance_begin> stands in the instance 'a'"),
        (LEAF + "\n" + LEAF, ":9: .* 'leaf' is defined already, at .*:6"),
        ("<object_instance_begin/>", ":6: <object_instance_begin> .*name"),
        (LEAF.replace(TRIANGLE, CALL), ":7: .*an instance contains itself: leaf → leaf"),
        (
            LEAF.replace(TRIANGLE, '<light_source type="ambient" L="1"/>'),
            ":7: <light_source> stands in the instance 'leaf', and an instance has no lights",
        ),
        ('<matrix value="1 2 3"/>', ":6: <matrix> value must be 12 finite numbers, not '1 2 3'"),
        (f'<matrix value="{"1 " * 12}"/>', ":6: <matrix> value must be a matrix that does not flatten everything"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path, world, told):
    with pytest.raises(tt.InputError, match=told):
        read(tmp_path, document(world))


def test_a_great_many_places_are_refused_in_no_time(tmp_path):
    world = LEAF
    names = ["leaf", *(f"level {k}" for k in range(30))]
    for called, name in zip(names, names[1:], strict=False):
        call = f'<object_instance_call name="{called}"/>'
        world += f'<object_instance_begin name="{name}"/>{call}{call}<object_instance_end/>\n'
    found = read(tmp_path, document(world + f'<object_instance_call name="{names[-1]}"/>'))
    with pytest.raises(tt.InputError, match="more than 10,000,000 places"):
        tt.scene_from_mesh(found.mesh)


def test_a_group_is_written_and_read_again(tmp_path, rng):
    square, matrices = Mesh(*SQUARE, source="square"), np.tile(np.eye(4), (3, 1, 1))
    matrices[1:, :3] = rng.normal(size=(2, 3, 4))
    branch = group([square, Instances(square, matrices)], "branch")
    mesh = group([Mesh(SQUARE[0] * 4, SQUARE[1], source="ground"), Instances(branch, matrices)], "forest")
    view = {"eye": (0.0, 0.0, 9.0), "at": (0.0, 0.0, 0.0), "up": (0.0, 1.0, 0.0), "projection": "perspective"}
    text = as_rt3(Document(mesh, [Shot(view, FilmSettings(), IntegratorSettings())]), tmp_path / "a.xml")
    assert text.count("object_instance_begin") == 2
    again = read(tmp_path, text)
    flat, expected = resolve_instances(again.mesh, choice="copied"), resolve_instances(mesh, choice="copied")
    np.testing.assert_array_equal(flat.vertices[flat.faces], expected.vertices[expected.faces])
    assert flat.num_primitives == 2 + 3 * (2 + 3 * 2)
