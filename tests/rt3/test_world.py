"""The world of RT3 documents: contents, lights, transforms."""

import numpy as np
import pytest
from rt3_text import document, read
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Instances, group, resolve_instances
from taichi_tracer.rt3.document import Document, FilmSettings, IntegratorSettings, Shot
from taichi_tracer.rt3.world import rotation
from taichi_tracer.rt3.write import as_rt3
from taichi_tracer.system.errors import InputError

# ── contents ──


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
        (CALL, r":6: unknown <object_instance_call> name 'leaf'"),
        (
            LEAF + "\n" + CALL.replace("leaf", "lief"),
            r":9: unknown <object_instance_call> name 'lief': did you mean 'leaf'",
        ),
        ("<object_instance_end/>", ":6: <object_instance_end> has no object_instance_begin before it"),
        ('<object_instance_begin name="a"/>', ":7: <world_end> stands in the instance 'a', which began at .*:6"),
        ('<object_instance_begin name="a"/>\n' + LEAF, ":7: <object_instance_begin> stands in the instance 'a'"),
        (LEAF + "\n" + LEAF, ":9: .* 'leaf' is defined already"),
        ("<object_instance_begin/>", ":6: <object_instance_begin> .*name"),
        (LEAF.replace(TRIANGLE, CALL), ":7: .*unknown .*leaf"),
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


# ── lights ──


ALL = """<light_source type="ambient" L="0.1 0.2 0.3"/>
<light_source type="directional" L="1 1 1" scale="2" from="1 1 1" to="0 0 0"/>
<light_source type="point" I="1 2 3" scale="2 1 0" from="1 2 3" attenuation="1 0.5 0.25"/>
<light_source type="spot" I="4" from="0 0 5" to="0 0 0" cutoff="40" falloff="10"/>"""


def lights(folder, world):
    return read(folder, document(world)).lights


def test_each_kind_has_its_numbers(tmp_path):
    ambient, sun, point, spot = lights(tmp_path, ALL)
    assert ambient.intensity == (0.1, 0.2, 0.3)
    assert (sun.irradiance, sun.direction) == ((2, 2, 2), (-1, -1, -1))
    assert (point.position, point.intensity, point.attenuation) == ((1, 2, 3), (2, 2, 0), (1, 0.5, 0.25))
    assert (spot.intensity, spot.attenuation) == (
        (4, 4, 4),
        (1, 0, 0),
    )  # no attenuation is said
    assert (spot.position, spot.target, spot.cutoff, spot.falloff) == ((0, 0, 5), (0, 0, 0), 40, 10)


def test_the_transform_moves_lights(tmp_path):
    world = '<translate value="10 0 0"/><rotate angle="90" axis="0 0 1"/>'
    world += '<light_source type="point" I="1" from="1 0 0"/>'
    world += '<light_source type="directional" L="1" from="0 0 0" to="1 0 0"/>'
    point, sun = lights(tmp_path, world)
    np.testing.assert_allclose(point.position, [10, 1, 0], atol=1e-12)
    np.testing.assert_allclose(sun.direction, [0, 1, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("element", "told"),
    [
        ('type="sun" L="1"', "'sun'"),
        ('type="ambient"', "needs the attribute L"),
        ('type="ambient" L="-1 0 0"', "must not be negative"),
        ('type="ambient" L="1" scale="-1"', "must not be negative"),
        ('type="ambient" L="1" I="1"', "mean the same"),
        ('type="ambient" L="1 2"', "L must be 1 or 3 finite numbers"),
        ('type="ambient" L="1e400 0 0"', "finite"),
        ('type="directional" L="1" from="1 2 3" to="1 2 3"', "direction must have a length"),
        ('type="point" I="1"', "needs the attribute from"),
        ('type="point" I="1" from="0 0"', "from must be 3 finite numbers"),
        ('type="point" I="1" from="0 0 0" attenuation="0 0 0"', "one number of attenuation must be above 0"),
        (
            'type="point" I="1" from="0 0 0" attenuation="1 -1 0"',
            "attenuation must be three finite numbers of at least 0",
        ),
        ('type="spot" I="1" from="0 0 1"', "needs the attribute to"),
        ('type="spot" I="1" from="0 0 1" to="0 0 1"', "the way to its target must have a length"),
        ('type="spot" I="1" from="0 0 1" to="0 0 0" cutoff="10" falloff="20"', "0 <= falloff <= cutoff"),
        ('type="spot" I="1" from="0 0 1" to="0 0 0" cutoff="-1"', "0 <= falloff <= cutoff"),
        ('type="spot" I="1" from="0 0 1" to="0 0 0" cutoff="a"', "cutoff must be a finite number"),
    ],
)
def test_a_wrong_light_is_told_with_its_line(tmp_path, element, told):
    with pytest.raises(tt.InputError, match=r"scene\.xml:6: ") as error:
        lights(tmp_path, f"<light_source {element}/>")
    assert told in str(error.value)
    assert "\n" not in str(error.value)


def test_lights_stand_in_the_world(tmp_path):
    text = document("").replace("<world_begin/>", '<light_source type="ambient" L="1"/><world_begin/>')
    with pytest.raises(tt.InputError, match="belongs into the world"):
        read(tmp_path, text)


def test_what_is_written_is_read_again(tmp_path):
    first = read(tmp_path, document(ALL + '<material type="blinn" mirror="0.5"/><object type="sphere" radius="1"/>'))
    path = tmp_path / "again.xml"
    again = read(tmp_path, as_rt3(first, path), "again.xml")
    assert [repr(light) for light in again.lights] == [repr(light) for light in first.lights]
    assert again.mesh.materials[0].Km == (0.5, 0.5, 0.5)


def test_scenes_have_the_lights_of_the_document_and_others_beside(tmp_path, f32):
    path = tmp_path / "scene.xml"
    path.write_text(document('<light_source type="ambient" L="1"/><object type="sphere" radius="1"/>'))
    scene = tt.load_scene_data(path, lights=[tt.PointLight()])
    assert [light.name for light in scene.lights] == ["ambient", "point"]


# ── the world ──


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
