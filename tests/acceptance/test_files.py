"""Files of other programs: what is read, what is a note, and what is one line; every file is made here."""

import itertools
import json
import struct
import subprocess
import sys
import warnings

import numpy as np
import pytest
from PIL import Image

import taichi_tracer as tt

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
TRIANGLE = np.eye(3)[[2, 0, 1]] - [0, 0, 1] + np.array([[0, 0, 0], [0, 0, 1], [0, 0, 1]])  # (0,0,0), (1,0,0), (0,1,0)
CODES = {"f4": 5126, "u1": 5121, "u2": 5123, "i2": 5122, "i1": 5120}
WIDTHS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


@pytest.fixture
def mesh_of(tmp_path):
    """The mesh of a file with a content."""

    def load(name, content):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return tt.load_mesh(path)

    return load


def area(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a).sum(axis=0) / 2


# ── PLY and STL ──


def ply(columns, face="", face_rows="", form="ascii"):
    properties = "".join(f"property {kind} {name}\n" for kind, name in columns)
    return (
        f"ply\nformat {form} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{properties}"
        f"element face 1\nproperty list uchar int vertex_indices\n{face}end_header\n"
    )


@pytest.mark.parametrize("names", [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
@pytest.mark.parametrize("has_colours", [False, True])
def test_coordinates_without_a_picture_change_nothing(mesh_of, names, has_colours):
    columns = [("float", name) for name in names] + [("uchar", name) for name in ("red", "green", "blue")] * has_colours
    rows = "".join(f"{x} {y} {z} .5 .5{' 255 0 0' * has_colours}\n" for x, y, z in SQUARE)
    mesh = mesh_of("a.ply", ply(columns) + rows + "4 0 1 2 3\n")
    assert (mesh.materials[0].map_Kd, mesh.materials[0].Kd[0]) == (None, 1.0 if has_colours else 0.8)
    assert has_colours == (mesh.corner_color is not None)


def test_coordinates_of_faces_and_a_picture_that_a_comment_names(mesh_of, tmp_path):
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "my picture.png")
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in SQUARE) + "4 0 1 2 3 8 0 0 1 0 1 1 0 1\n"
    plain = ply([], "property list uchar float texcoord\n") + rows
    assert mesh_of("a.ply", plain).materials == [tt.Material()]
    mesh = mesh_of("b.ply", plain.replace("element v", "comment TextureFile my picture.png\nelement v"))
    assert mesh.materials[0].map_Kd.pixels[0, 0].tolist() == [1, 0, 0]
    assert mesh.corner_uv[0].tolist() == [[0, 0], [1, 0], [1, 1]]


@pytest.mark.parametrize("tail", [b"", b"\n", b"\0" * 7])
def test_bytes_after_the_end_are_a_note(mesh_of, tail):
    binary = ply([], form="binary_little_endian").encode() + SQUARE.astype("<f4").tobytes()
    meshes = [mesh_of("a.ply", binary + struct.pack("<B4i", 4, 0, 1, 2, 3) + tail)]
    triangle = struct.pack("<12fH", 0, 0, 1, *TRIANGLE.ravel(), 0)
    meshes.append(mesh_of("a.stl", bytes(80) + struct.pack("<I", 2) + triangle * 2 + tail))
    for mesh in meshes:
        assert (len(mesh.faces), len(mesh.notes)) == (2, bool(tail))
        assert not tail or f"{len(tail)} bytes after the last" in mesh.notes[0]


# ── glTF ──


def glb(arrays, primitive, **content):
    """A GLB; ``arrays``: (dtype, rows, other members of the accessor)."""
    views, accessors, body = [], [], b""
    for kind, rows, *more in arrays:
        rows = np.asarray(rows, "<" + kind)
        rows = rows.reshape(len(rows), -1)
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": rows.nbytes})
        accessors.append({"componentType": CODES[kind], "count": len(rows), "type": WIDTHS[rows.shape[1]]})
        accessors[-1] |= {"bufferView": len(views) - 1, **(more[0] if more else {})}
        body += rows.tobytes() + bytes(-rows.nbytes % 4)
    content = {"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}]} | content
    text = json.dumps({"accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(body)}]} | content)
    text = text.encode() + b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


POSITION = {"attributes": {"POSITION": 0}}
POINTS = ("f4", TRIANGLE)


@pytest.mark.parametrize(
    ("mode", "alpha", "cutoff", "hits", "notes"),
    [("MASK", 0.2, 0.5, 0, 0), ("MASK", 0.7, 0.5, 1, 0), ("MASK", 0.7, 0.9, 0, 0), ("BLEND", 0, 0.5, 0, 1)],
)
def test_alpha_of_the_factor_counts_without_a_texture(tmp_path, mode, alpha, cutoff, hits, notes):
    look = {"alphaMode": mode, "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, alpha]}}
    look |= {"alphaCutoff": cutoff} if mode == "MASK" else {}
    (tmp_path / "a.glb").write_bytes(glb([POINTS], {**POSITION, "material": 0}, materials=[look]))
    scene = tt.load_scene_data(tmp_path / "a.glb")
    assert np.asarray(scene.intersect([[0.2, 0.2, 1]], [[0, 0, -1]]).is_hit).sum() == hits
    assert len(scene.notes) == notes


PICTURE = {"textures": [{"source": 0}], "images": [{"uri": "two%20words.png"}]}
UV = [[0, 0], [1, 0], [0, 1]]


@pytest.mark.parametrize(
    ("kind", "uv", "info", "expected"),
    [
        ("f4", UV, {"offset": [0.5, 0.25]}, [[0.5, 0.75], [1.5, 0.75], [0.5, -0.25]]),
        ("f4", UV, {"scale": [2, 3]}, [[0, 1], [2, 1], [0, -2]]),
        ("f4", UV, {"rotation": np.pi / 2}, [[0, 1], [0, 2], [1, 1]]),  # v points downwards: from v to u
        ("f4", UV, {"rotation": np.pi / 2, "scale": [2, 3], "offset": [1, 0]}, [[1, 1], [1, 3], [4, 1]]),
        ("u2", np.array(UV) * 65535, {}, [[0, 1], [1, 1], [0, 0]]),
        ("u1", np.array(UV) * 255, {"texCoord": 1}, [[0, 1], [1, 1], [0, 0]]),
    ],
)
@pytest.mark.parametrize("number", [0, 1])
def test_coordinates_have_their_set_and_their_transform(mesh_of, tmp_path, kind, uv, info, expected, number):
    Image.new("RGB", (2, 2)).save(tmp_path / "two words.png")
    number = info.get("texCoord", number)
    share = {} if kind == "f4" else {"normalized": True}
    texture = {"index": 0, "texCoord": number, "extensions": {"KHR_texture_transform": info}}
    primitive = {"attributes": {"POSITION": 0, f"TEXCOORD_{number}": 1}, "material": 0}
    looks = [{"pbrMetallicRoughness": {"baseColorTexture": texture}}]
    required = {"extensionsRequired": ["KHR_texture_transform"], "extensionsUsed": ["KHR_texture_transform"]}
    mesh = mesh_of("a.glb", glb([POINTS, (kind, uv, share)], primitive, materials=looks, **PICTURE, **required))
    np.testing.assert_allclose(mesh.corner_uv[0], expected, atol=1e-6)
    assert mesh.notes == []


TO_UP = np.array([[0, 2, 0]])


@pytest.mark.parametrize(
    ("arrays", "primitive", "content", "expected"),
    [
        ([("i2", TRIANGLE * 32767, {"normalized": True})], {}, {}, TRIANGLE),
        ([("u1", TRIANGLE * 255, {"normalized": True})], {}, {}, TRIANGLE),
        ([("i1", TRIANGLE * 100)], {}, {}, TRIANGLE * 100),
        (
            [POINTS, ("f4", [[0, 0, 1]] * 3), ("f4", TRIANGLE * 2)],
            {"targets": [{"POSITION": 1}, {"POSITION": 2}]},
            {"nodes": [{"mesh": 0, "weights": [0.5, 1]}]},
            TRIANGLE * 3 + [0, 0, 0.5],
        ),
        (
            [POINTS, ("u1", [[1, 0, 0, 0]] * 3), ("u1", [[255, 0, 0, 0]] * 3, {"normalized": True})],
            {"attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}},
            {
                "nodes": [
                    {"mesh": 0, "skin": 0, "translation": [9, 9, 9]},
                    {"translation": [5, 0, 0]},
                    {"children": [3]},
                ]
                + [{"translation": [0, 2, 0]}],
                "skins": [{"joints": [1, 3]}],
            },
            TRIANGLE + TO_UP,
        ),
        (
            [POINTS, ("f4", [[0, 0, 0], [0, 2, 0]]), ("f4", [[1, 1, 1], [3, 3, 3]])],
            {},
            {
                "nodes": [
                    {
                        "mesh": 0,
                        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1, "SCALE": 2}}},
                    }
                ]
            },
            [*TRIANGLE, *(3 * TRIANGLE + TO_UP)],
        ),
    ],
)
def test_positions_are_those_of_the_pose(mesh_of, arrays, primitive, content, expected):
    mesh = mesh_of("a.glb", glb(arrays, POSITION | primitive, **content))
    np.testing.assert_allclose(mesh.vertices, expected, atol=1e-6)
    assert mesh.notes == []


@pytest.mark.parametrize("name", ["KHR_materials_pbrSpecularGlossiness", "KHR_materials_clearcoat", "XX_never_heard"])
def test_an_extension_is_a_note_or_where_it_is_required_a_line(mesh_of, name):
    looks = [{"extensions": {name: {}}}, {"extensions": {name: {}}}]
    found = mesh_of("a.glb", glb([POINTS], {**POSITION, "material": 0}, materials=looks, extensionsUsed=[name]))
    (note,) = found.notes
    assert note.endswith(f"the extension {name} is not read")
    with pytest.raises(tt.InputError, match=f"it needs the extension {name}"):
        mesh_of("b.glb", glb([POINTS], POSITION, extensionsRequired=[name], extensionsUsed=[name]))


def test_the_command_line_ends_with_one_line_and_2(tmp_path):
    (tmp_path / "b.glb").write_bytes(glb([POINTS], POSITION, extensionsRequired=["XX_never_heard"]))
    command = [sys.executable, "-m", "taichi_tracer", "info", str(tmp_path / "b.glb")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    (line,) = [line for line in done.stderr.splitlines() if "b.glb" in line]
    assert "it needs the extension XX_never_heard, which is not read" in line
    assert "Traceback" not in done.stderr


# ── pictures ──

HDR = np.arange(1, 9).reshape(2, 4)
STEPS = [f"{s}{a}" for a in "YX" for s in "-+"]


@pytest.mark.parametrize("axes", [pair for pair in itertools.permutations(STEPS, 2) if pair[0][1] != pair[1][1]])
@pytest.mark.parametrize("exposures", [(), (2.0,), (2.0, 0.25)])
def test_hdr_axes_and_exposures(tmp_path, axes, exposures):
    pytest.importorskip("OpenImageIO")
    stored = HDR[:: -1 if "+Y" in axes else 1, :: -1 if "-X" in axes else 1]
    stored = stored if axes[0][1] == "Y" else stored.T
    line = " ".join(f"{axis} {count}" for axis, count in zip(axes, stored.shape, strict=True))
    head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n" + "".join(f"EXPOSURE={one}\n" for one in exposures) + f"\n{line}\n"
    (tmp_path / "a.hdr").write_bytes(head.encode() + bytes(b for v in stored.ravel() for b in (16 * v, 0, 0, 129)))
    image = tt.read_image(tmp_path / "a.hdr")
    np.testing.assert_allclose(image[..., 0], HDR / 8 / np.prod(exposures))


@pytest.mark.parametrize("place", [(0, 0, 4, 2), (0, 0, 2, 1), (-2, -1, 8, 4), (1, 1, 2, 3), (9, 9, 2, 2)])
def test_exr_shows_the_display_window(tmp_path, place):
    oiio = pytest.importorskip("OpenImageIO")
    x, y, width, height = place
    spec = oiio.ImageSpec(width, height, 3, "float")
    spec.x, spec.y, spec.full_width, spec.full_height = x, y, 4, 2
    v, u = np.mgrid[y : y + height, x : x + width]
    file = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    file.open(str(tmp_path / "a.exr"), spec)
    file.write_image(np.repeat((1 + u + 10 * v)[..., None], 3, axis=2).astype(np.float32))
    file.close()
    v, u = np.mgrid[:2, :4]
    inside = (u >= x) & (u < x + width) & (v >= y) & (v < y + height)
    np.testing.assert_array_equal(tt.read_image(tmp_path / "a.exr")[..., 1], np.where(inside, 1 + u + 10 * v, 0))


@pytest.mark.parametrize(
    "names", [["Z", "View.Combined.R", "View.Combined.G", "View.Combined.B"], ["Z", "B", "G", "R"]]
)
def test_exr_layers_are_named(tmp_path, names):
    oiio = pytest.importorskip("OpenImageIO")
    spec = oiio.ImageSpec(1, 1, 4, "float")
    spec.channelnames = names
    file = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    file.open(str(tmp_path / "a.exr"), spec)
    file.write_image(np.array([[[ord(name[-1]) for name in names]]], np.float32))
    file.close()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert tt.read_image(tmp_path / "a.exr")[0, 0].tolist() == [ord(c) for c in "RGB"]
    assert [str(one.message).endswith("View.Combined is read") for one in caught] == [True] * ("." in names[1])


# ── OBJ and MTL ──


@pytest.mark.parametrize("name", ["wood#1.png", "two  blanks.png", "#.png", "a # b.png"])
@pytest.mark.parametrize("line", ["map_Kd {}", 'map_Kd "{}"', "map_Kd -clamp on {}"])
def test_a_name_is_the_rest_of_its_line(mesh_of, tmp_path, name, line):
    Image.new("RGB", (2, 2)).save(tmp_path / name)
    (tmp_path / "my m.mtl").write_text(f"newmtl m\nKd 1.5 1 1\n{line.format(name)}\n")
    mesh = mesh_of("a.obj", 'mtllib "my m.mtl"\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n')
    assert mesh.materials[0].map_Kd.source == name
    (note,) = mesh.notes
    assert "my m.mtl:2: Kd 1.5 1 1 is above 1" in note


@pytest.mark.parametrize(
    "vn", ["inf 0 0", "-1.#IND00 0 0", "1.#QNAN 0 0", "nan 0 1", "-nan(ind) 0 0", "0 1.#INF 0", "1e21 0 0"]
)
def test_wild_normals_are_left_out(mesh_of, vn):
    mesh = mesh_of("a.obj", f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvn {vn}\nf 1//1 2//1 3//2\n")
    assert mesh.face_normals.tolist() == [[0, 0, -1]]
    assert "1 normals are not finite or longer than 1e+20" in mesh.notes[0]


@pytest.mark.parametrize(
    ("mtl", "usemtl", "told"), [("", "usemtl oak", "'oak'"), ("mtllib gone.mtl\n", "usemtl oak", "gone.mtl")]
)
@pytest.mark.parametrize("second", ["", "usemtl oak\nf 3 2 1\n"])
def test_an_unknown_material_is_grey(mesh_of, mtl, usemtl, told, second):
    mesh = mesh_of("a.obj", f"{mtl}v 0 0 0\nv 1 0 0\nv 0 1 0\n{usemtl}\nf 1 2 3\n{second}")
    assert [(one.name, one.Kd) for one in mesh.materials] == [("oak", (0.8, 0.8, 0.8))]
    assert len(mesh.notes) == 1
    assert told in mesh.notes[0]


L_SHAPE = [(0, 1), (0, 0), (4, 0), (4, 4), (3, 4), (3, 1)]
STAR = [(r * np.cos(k * np.pi / 5), r * np.sin(k * np.pi / 5)) for k in range(10) for r in [(2, 0.5)[k % 2]]]
SHAPES = {"L": L_SHAPE, "star": STAR, "repeated": [p for p in L_SHAPE for _ in range(2)], "clockwise": L_SHAPE[::-1]}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize("kind", ["obj", "ply", "off"])
def test_concave_polygons_have_their_area(mesh_of, name, turn, kind):
    x, y = np.roll(SHAPES[name], turn, axis=0).T
    x, y = x + 5e5 * (turn == 3), y
    signed = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2
    points = np.stack([x, y, 0.5 * x - y], axis=1) if turn % 2 else np.stack([0 * x, x, y], axis=1)
    rows = "".join(f"{a!r} {b!r} {c!r}\n" for a, b, c in points.tolist())
    ids = range(len(points))
    face = f"{len(points)} {' '.join(map(str, ids))}\n"
    text = {
        "obj": "".join(f"v {row}\n" for row in rows.splitlines()) + f"f {' '.join(str(k + 1) for k in ids)}\n",
        "ply": ply([]).replace("vertex 4", f"vertex {len(points)}") + rows + face,
        "off": f"OFF\n{len(points)} 1 0\n{rows}{face}",
    }[kind]
    mesh = mesh_of(f"a.{kind}", text)
    expected = np.array([-0.5, 1, 1]) * signed if turn % 2 else np.array([1, 0, 0]) * signed
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    np.testing.assert_allclose(area(mesh), expected, rtol=1e-6)
    sizes = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    np.testing.assert_allclose(sizes, np.linalg.norm(expected), rtol=1e-6)


@pytest.mark.parametrize("color", ["255 0 0", "255 0 0 255", "1 0 0", "1.0 0 0 .5"])
def test_colours_of_vertices_are_shares_or_bytes(mesh_of, color):
    mesh = mesh_of("a.obj", "".join(f"v {p} {color}\n" for p in ("0 0 0", "1 0 0", "0 1 0")) + "f 1 2 3\n")
    assert (mesh.corner_color[0].tolist(), mesh.notes) == ([[1, 0, 0]] * 3, [])


# ── places ──

CUBE = np.array(list(itertools.product((-1, 1), repeat=3)), float)
SIDES = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"


@pytest.mark.parametrize("place", [(1e6, 0, 0), (1e6, 1e6, 1e6), (-3e5, 7, 1e6)])
def test_the_first_view_does_not_depend_on_the_place(tmp_path, place):
    views = []
    for shift in (np.zeros(3), np.array(place)):
        rows = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in (CUBE + shift).tolist())
        (tmp_path / "cube.obj").write_text(rows + SIDES)
        scene = tt.load_scene_data(tmp_path / "cube.obj")
        views.append([scene.view["eye"] - shift, scene.view["at"] - shift])
    np.testing.assert_allclose(views[1], views[0], atol=1e-6)
    assert "steps of 0.062 in f32: use --precision f64" in scene.notes[-1]


@pytest.mark.parametrize("size", [1e20, 1e-20])
def test_a_mesh_without_areas_in_f32_is_told(tmp_path, size):
    rows = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in (CUBE * size / 2).tolist())
    (tmp_path / "cube.obj").write_text(rows + SIDES)
    assert (
        "such areas are no numbers of f32: use --precision f64" in tt.load_scene_data(tmp_path / "cube.obj").notes[-1]
    )


def test_a_document_reads_its_neighbours_and_its_sun_shines_to_the_origin(tmp_path):
    for name in ("scenes", "parts"):
        (tmp_path / name).mkdir()
    sun = '<light_source type="directional" L="1 1 1" from="40 30 -30"/>'
    (tmp_path / "parts" / "sun.xml").write_text(f"<RT3>{sun}</RT3>")
    head = '<lookat look_from="0 7 0" look_at="0 0 0" up="0 0 1"/><camera type="perspective" fov="40"/>'
    head += '<film x_res="4" y_res="3"/>'
    world = '<include filename="../parts/sun.xml"/><object type="sphere" radius="1" center="0 0 0"/>'
    (tmp_path / "scenes" / "a.xml").write_text(f"<RT3>{head}<world_begin/>{world}<world_end/></RT3>")
    (light,) = tt.load_scene_data(tmp_path / "scenes" / "a.xml").lights
    assert light.direction == (-40, -30, 30)
