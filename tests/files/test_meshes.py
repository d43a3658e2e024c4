"""PLY, STL, glTF and OFF files and trimesh's objects: the triangles, normals and materials that they hold."""

import base64
import json
import struct

import numpy as np
import pytest
import trimesh
from shapes import SQUARE, sphere
from support import data_file

import taichi_tracer as tt
from taichi_tracer.files import read
from taichi_tracer.files.meshes import from_trimesh
from taichi_tracer.system.errors import InputError

PLY = """ply
format ascii 1.0
element vertex {vertices}
property float x
property float y
property float z
{more}element face {faces}
property list uchar int vertex_indices
end_header
{body}"""
CORNERS = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
NORMALS = "property float nx\nproperty float ny\nproperty float nz\n"


def ply(body, vertices=4, faces=1, more=""):
    return PLY.format(vertices=vertices, faces=faces, more=more, body=body).encode()


def binary_stl(triangles, header=b"made by a test"):
    """``triangles``: (n, 3, 3)."""
    records = [struct.pack("<12fH", 0, 0, 1, *np.ravel(t), 0) for t in triangles]
    return header.ljust(80) + struct.pack("<I", len(records)) + b"".join(records)


def ascii_stl(triangles):
    facets = [
        "facet normal 0 0 1\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in np.asarray(t).tolist())
        + "endloop\nendfacet\n"
        for t in triangles
    ]
    return ("solid mesh\n" + "".join(facets) + "endsolid mesh\n").encode()


def gltf(nodes, materials=(), of_meshes=(None,), normals=None, **more):
    """(content, buffer) of a glTF with one square for each entry of ``of_meshes``, the number of its material."""
    points = np.asarray(SQUARE[0], "<f4")
    parts = [points.tobytes(), np.asarray(SQUARE[1], "<u4").tobytes()]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5125, "count": 6, "type": "SCALAR"},
    ]
    primitive = {"attributes": {"POSITION": 0}, "indices": 1}
    if normals is not None:
        parts.append(np.asarray(normals, "<f4").tobytes())
        accessors.append({"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC3"})
        primitive["attributes"]["NORMAL"] = 2
    starts = np.cumsum([0] + [len(p) for p in parts]).tolist()
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": [{"primitives": [primitive if m is None else {**primitive, "material": m}]} for m in of_meshes],
        "accessors": accessors,
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
            for start, part in zip(starts, parts, strict=False)
        ],
        "buffers": [{"byteLength": starts[-1]}],
        **more,
    }
    if materials:
        content["materials"] = list(materials)
    return content, b"".join(parts)


def glb(*arguments, **options):
    content, buffer = gltf(*arguments, **options)
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(buffer), 0x004E4942) + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.fixture
def mesh_of(tmp_path):
    """Reads bytes as a file of a name."""

    def read_bytes(name, content):
        (tmp_path / name).write_bytes(content)
        return read(tmp_path / name)

    return read_bytes


# PLY


def test_ply_normals_are_those_of_the_file(mesh_of):
    mesh = mesh_of("a.ply", ply("0 0 0 1 0 0\n1 0 0 0 1 0\n1 1 0 0 0 -1\n3 0 1 2\n", vertices=3, more=NORMALS))
    assert mesh.normals.tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, -1]]
    assert mesh.face_normals.tolist() == [[0, 1, 2]]


# STL and OFF


@pytest.mark.parametrize("content", [binary_stl, ascii_stl])
def test_stl_triangles_keep_their_order_and_get_no_normals(mesh_of, content):
    triangles = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0.5]], [[5, 0, 0], [1, 0, 0], [0, 0, 0]]])
    mesh = mesh_of("a.STL", content(triangles))
    assert mesh.vertices[mesh.faces].tolist() == triangles.tolist()
    assert mesh.normals.shape == mesh.face_normals.shape == (0, 3)


# glTF


def test_transforms_of_a_node_and_its_parents_are_applied(mesh_of):
    turn = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]  # 90° around z: x becomes y
    nodes = [
        {"children": [1], "translation": [10, 0, 0]},
        {"mesh": 0, "rotation": turn, "scale": [2, 3, 1], "translation": [0, 0, 5]},
    ]
    x, y, z = SQUARE[0].T
    mesh = mesh_of("a.glb", glb(nodes))
    assert np.allclose(mesh.vertices, np.stack([10 - 3 * y, 2 * x, z + 5], -1), atol=1e-6)
    assert np.array_equal(mesh.faces, SQUARE[1])


def test_a_mirrored_node_keeps_fronts_in_front(mesh_of):
    mesh = mesh_of("a.glb", glb([{"mesh": 0, "scale": [-1, 1, 1]}], normals=[[0, 0, 1]] * 4))
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()
    assert np.array_equal(mesh.normals[mesh.face_normals][..., 2], np.ones((2, 3)))
    assert np.array_equal(mesh.face_normals, mesh.faces)


def test_normals_follow_a_stretch_by_the_inverse_transpose(mesh_of):
    slope = np.array([1, 0, 1]) / np.sqrt(2)
    mesh = mesh_of("a.glb", glb([{"mesh": 0, "scale": [2, 1, 1]}], normals=[slope] * 4))
    lengths = np.linalg.norm(mesh.normals, axis=1, keepdims=True)
    assert np.allclose(mesh.normals / lengths, np.array([0.5, 0, 1]) / np.sqrt(1.25), atol=1e-6)


def test_emission_is_multiplied_by_its_strength(mesh_of):
    strength = {"KHR_materials_emissive_strength": {"emissiveStrength": 8.0}}
    lamp = {"name": "lamp", "emissiveFactor": [1.0, 0.5, 0.25], "extensions": strength}
    plain = {"name": "plain", "emissiveFactor": [1.0, 0.5, 0.25]}
    nodes = [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 1}]
    mesh = mesh_of("a.glb", glb(nodes, [lamp, plain], (0, 1)))
    assert {m.name: m.Ke for m in mesh.materials} == {"lamp": (8, 4, 2), "plain": (1, 0.5, 0.25)}


def test_base_colours_are_exact_and_white_where_unset(mesh_of):
    red = {"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [0.123456, 0.2, 0.3, 0.5], "metallicFactor": 0}}
    nodes = [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 1}]
    mesh = mesh_of("a.glb", glb(nodes, [red, {}], (0, 1)))
    assert {m.name: m.Kd for m in mesh.materials} == {"red": (0.123456, 0.2, 0.3), "default": (1, 1, 1)}


@pytest.mark.parametrize(
    ("metal", "roughness", "kd", "f0", "alpha", "brdf"),
    [
        (0.0, 1.0, 0.5, 0.04, 1.0, "layered"),
        (0.25, 0.5, 0.375, 0.155, 0.25, "layered"),
        (1.0, 0.5, 0.0, 0.5, 0.25, "microfacet"),
        (1.0, 0.0, 0.0, 0.5, 1e-6, "smooth_metal"),
        (None, None, 0.0, 0.5, 1.0, "microfacet"),  # both are 1 where they are not given
    ],
)
def test_metalness_and_roughness_are_those_of_the_format(metal, roughness, kd, f0, alpha, brdf, mesh_of, f32):
    values = {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": metal, "roughnessFactor": roughness}
    look = {"pbrMetallicRoughness": {name: value for name, value in values.items() if value is not None}}
    mesh = mesh_of("a.glb", glb([{"mesh": 0}], [look], (0,)))
    (material,) = mesh.materials
    found = material.Kd[0], material.F0[0], material.alpha_x, material.alpha_y
    np.testing.assert_allclose(found, [kd, f0, alpha, alpha])
    scene = tt.SceneData(mesh)
    assert [scene.material_library.brdfs[i].name for i in scene.effects.brdfs] == [brdf]


def test_a_gltf_text_with_its_buffer_inside_or_beside_is_read(mesh_of, tmp_path):
    content, buffer = gltf([{"mesh": 0}], [{"name": "lamp", "emissiveFactor": [1, 1, 1]}], (0,))
    (tmp_path / "data.bin").write_bytes(buffer)
    inside = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
    for uri in (inside, "data.bin"):
        content["buffers"][0]["uri"] = uri
        mesh = mesh_of("a.gltf", json.dumps(content).encode())
        assert np.array_equal(mesh.vertices, SQUARE[0])
        assert mesh.materials[0].Ke == (1, 1, 1)


def test_a_picture_of_the_base_colour_is_on_the_surface(tmp_path):
    """Written by trimesh: its colours are linear afterwards, and its coordinates begin at the bottom left."""
    import trimesh
    from PIL import Image

    picture = Image.fromarray(np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [128, 128, 128]]], np.uint8))
    look = trimesh.visual.material.PBRMaterial(baseColorTexture=picture, metallicFactor=1.0, roughnessFactor=0.5)
    uv = np.array([[0, 0], [1, 0], [0, 1.0]])
    mesh = trimesh.Trimesh(np.eye(3), [[0, 1, 2]], process=False)
    mesh.visual = trimesh.visual.TextureVisuals(uv=uv, material=look)
    trimesh.Scene(mesh).export(tmp_path / "a.glb")
    found = read(tmp_path / "a.glb")
    assert found.has_pictures
    np.testing.assert_allclose(found.corner_uv, uv[found.faces], atol=1e-6)
    texture = found.materials[0].map_Kd
    np.testing.assert_allclose(texture.pixels[1], [[0, 0, 1], [0.2158605] * 3], atol=1e-5)
    assert found.materials[0].value("metallic", (0.0,) * 3) == (1, 1, 1)


# Damaged files


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.ply", b"", "it must begin with ply"),
        ("a.ply", b"not a mesh", "cannot be read as PLY"),
        ("a.ply", ply(CORNERS + "3 0 1 2\n", faces=2), "announces 2 rows of face and has 1"),
        ("a.ply", ply(CORNERS, faces=0), "no triangles"),
        ("a.stl", b"x" * 40, "cut short"),
        ("a.stl", binary_stl(SQUARE[0][SQUARE[1]])[:-1], "announces 2 triangles"),
        ("a.stl", ascii_stl(SQUARE[0][SQUARE[1]])[:-20], "endsolid is missing"),
        ("a.stl", binary_stl([]), "no triangles"),
        ("a.off", b"OFF\n4 2 0\n" + CORNERS.encode() + b"3 0 1 2\n", "a.off"),
        ("a.glb", glb([{"mesh": 0}])[:-8], "a.glb"),
        ("a.glb", b"glTF", "cannot be read as GLB"),
        ("a.gltf", b"{}", "a.gltf"),
    ],
)
def test_damaged_files_are_refused_by_name(mesh_of, name, content, message):
    with pytest.raises(InputError, match=message) as caught:
        mesh_of(name, content)
    assert str(caught.value).count("\n") == 0
    assert name in str(caught.value)


# trimesh's objects


def test_a_scene_is_the_sum_of_its_placed_meshes():
    scene = trimesh.Scene()
    for shift in (0, 5):
        square = trimesh.Trimesh(*SQUARE, process=False)
        scene.add_geometry(square, transform=trimesh.transformations.translation_matrix([0, 0, shift]))
    mesh = from_trimesh(scene)
    assert mesh.vertices[mesh.faces[:, 0], 2].tolist() == [0, 0, 5, 5]
    assert mesh.face_materials.tolist() == [0, 0, 0, 0]


# Real meshes


@pytest.mark.parametrize(
    ("name", "triangles", "normals", "low", "high"),
    [
        ("Duck.glb", 4212, 2399, [-0.692985, 0.099294, -0.613282], [0.961799, 1.6397, 0.539252]),
        ("featuretype.STL", 3476, 0, [-2.5, -1.25, 0], [2.5, 1.25, 1.375]),
        ("suzanne.ply", 968, 1966, [-1.367188, 0.28356, -0.895003], [1.367188, 2.25231, 0.808122]),
    ],
)
def test_real_meshes_have_their_triangles_normals_and_bounds(name, triangles, normals, low, high):
    mesh = read(data_file(name))
    assert (len(mesh.faces), len(mesh.normals)) == (triangles, normals)
    assert np.allclose([mesh.vertices.min(0), mesh.vertices.max(0)], [low, high], atol=1e-6)
    assert (mesh.faces.min(), mesh.faces.max()) == (0, len(mesh.vertices) - 1)


def test_lights_of_a_file_light_its_scene(tmp_path):
    lights = {"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 3.0}]}}
    node = {"extensions": {"KHR_lights_punctual": {"light": 0}}}
    (tmp_path / "a.glb").write_bytes(glb([{"mesh": 0, "children": [1]}, node], extensions=lights))
    mesh = read(tmp_path / "a.glb")
    assert [name for name, _ in mesh.lights] == ["directional"]


def shared_nodes(tmp_path, count):
    """A GLB file with one sphere of 8,000 triangles in several nodes, one of which is mirrored; and the transforms."""
    ball = trimesh.Trimesh(*sphere(80, 51), process=False)
    scene, transforms = trimesh.Scene(), np.tile(np.eye(4), (count, 1, 1))
    transforms[:, 0, 3] = 3 * np.arange(count)
    transforms[1, 0, 0] = -1
    scene.add_geometry(ball, geom_name="ball", node_name="node 0")
    for number, transform in enumerate(transforms):
        scene.graph.update(f"node {number}", geometry="ball", matrix=transform)
    scene.export(tmp_path / "balls.glb")
    return tmp_path / "balls.glb", transforms


def test_nodes_share_a_large_mesh_and_small_ones_are_copied(tmp_path):
    path, transforms = shared_nodes(tmp_path, 260)
    mesh = read(path)
    assert [len(mesh.faces), len(mesh.instances)] == [0, 260]
    assert len({id(one.mesh) for one in mesh.instances}) == 1
    scene = tt.load_scene_data(path)
    assert scene.effects.instances
    assert (scene.num_triangles, len(scene.mesh.faces)) == (260 * 8000, 8000)
    hits = scene.intersect(transforms[:, :3, 3] + (0.01, 0.02, 5), (0, 0, -1))
    assert (hits.triangle_id // 8000).tolist() == list(range(260))
    assert not hits.is_backfacing.any()
    few = read(shared_nodes(tmp_path, 3)[0])
    assert [len(few.faces), few.instances] == [24000, []]
