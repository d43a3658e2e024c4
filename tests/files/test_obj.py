"""OBJ files: every number and triangle in the file's order, and errors that name file and line."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from oracles import tiny_obj
from support import data_file

from taichi_tracer.files import read
from taichi_tracer.files.readers.obj import read_obj
from taichi_tracer.geometry import clean
from taichi_tracer.materials import Material
from taichi_tracer.meshes.polygons import fan
from taichi_tracer.system.errors import InputError

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@pytest.fixture
def obj(tmp_path):
    """Reads a text as the OBJ file mesh.obj."""

    def read_text(text, **others):
        for name, content in others.items():
            (tmp_path / f"{name}.mtl").write_text(content)
        path = tmp_path / "mesh.obj"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_obj(path)

    return read_text


# Order and numbers


@pytest.mark.parametrize(
    "word",
    ["0.1", "0.5094649999999999", "1e-310", "-0.0", "1.7976931348623157e308", ".5", "5.", "+3", "9007199254740993"],
)
@pytest.mark.parametrize("more", ["", "red"])  # a word that is no number
def test_numbers_are_the_nearest_float64(obj, word, more):
    x = obj(f"v {word} 0 0 {more}\n").vertices[0, 0]
    assert x == float(word)
    assert np.signbit(x) == word.startswith("-")


@pytest.mark.parametrize("extras", [("", "", ""), (" 1.0", " 9", " 9"), (" .1 .2 .3", "", " 1")])
def test_a_weight_or_colour_after_the_position_is_ignored(obj, extras):
    mesh = obj("v 1 2 3{}\nv 4 5 6{}\nv 7 8 9{}\nf 1 2 3\n".format(*extras))
    assert mesh.vertices.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]


# Faces


def test_negative_indices_count_back_from_where_they_stand(obj):
    mesh = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\nf -3 -2 -1\nf 1 -1 2\n")
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 2, 3], [0, 3, 1]]


# Text


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_backslash_continues_a_line(obj, end):
    mesh = obj(("v 0 \\\n0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 \\\n 3 \\\n 4\n").replace("\n", end))
    assert mesh.vertices[0].tolist() == [0, 0, 0]
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]


# Materials


def test_materials_come_in_the_order_of_first_use(obj):
    faces = "f 1 2 3\n"
    text = "mtllib a.mtl\n" + SQUARE + f"usemtl y\nusemtl idle\nusemtl z\n{faces}usemtl y\nf 1 2 3 4\nusemtl z\n{faces}"
    mesh = obj(text, a="newmtl y\nKd 1 0 0\nnewmtl idle\nnewmtl z\nKd 0 0 1\n")
    assert [m.name for m in mesh.materials] == ["z", "y"]
    assert [m.Kd for m in mesh.materials] == [(0, 0, 1), (1, 0, 0)]
    assert mesh.face_materials.tolist() == [0, 1, 1, 0]


# What cannot be used

NO_FACES = ["0 1 2", "1//0 2//1 3//1", "1 2", "", "1 2 x", "1 2 3.5", "1/1/1/1 2 3", "1 /2 3 4", "1 2 3_0"]
NO_POINTS = ["1 2", "1 2 z", "1 2 1.5.3", "1 2 0x10", "1 2 1_0"]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("f 1 2 5", r"vertex index 5 is out of range \(the file has 4 vertices\)"),
        ("f 5 1 2", "vertex index 5 is out of range"),
        ("f 1 2 -5", r"vertex index -5 is out of range \(4 vertices stand before it\)"),
        ("f 1//1 2//2 3//1", r"normal index 2 is out of range \(the file has 1 normals\)"),
        ("f 1//1 2//-2 3//1", r"normal index -2 is out of range \(1 normals stand before it\)"),
        ("f 1 2 99999999999999999999", r"vertex index 9\d+ is out of range"),
        *((f"f {corners}", f"'{corners}' cannot be read: a face needs at least 3 corners") for corners in NO_FACES),
        *((f"v {row}", f"'{row}' cannot be read: the numbers x y z are needed") for row in NO_POINTS),
        ("vn 1", "x y z are needed"),
    ],
)
def test_errors_name_file_and_line(obj, line, message):
    with pytest.raises(InputError, match=rf"mesh\.obj:8: .*{message}"):
        obj(SQUARE + "vn 0 0 1\nf 1//1 2//1 \\\n3//1\n" + line + "\nf 1 2 3\n")


def test_a_nan_vertex_is_read_and_its_triangles_are_dropped_and_counted(obj):
    mesh = obj(SQUARE + "v nan 0 0\nf 1 2 5\nf 1 2 3\nf 5 3 4\n")
    assert np.isnan(mesh.vertices[4, 0])
    cleaned = clean(mesh, np.float32)
    assert cleaned.dropped == 2
    assert "2 of 3 triangles dropped (2 with a vertex that is NaN, infinite or too large)" in cleaned.notes[0]
    assert "mesh.obj" in cleaned.notes[0]


# Against the oracle

NAMES = ["red", "blue", "grey"]
COORDINATE = st.one_of(st.integers(-99, 99), st.floats(allow_nan=False, allow_infinity=False))


@st.composite
def obj_texts(draw):
    """A small OBJ with polygons, vertex normals on some faces, materials, comments and odd blanks."""
    points = draw(st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), min_size=3, max_size=8))
    normals = draw(st.lists(st.tuples(*[st.floats(-1e9, 1e9)] * 3), max_size=4))
    corner = st.tuples(st.integers(1, len(points)), st.integers(1, max(1, len(normals))))
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points] + [f"vn {x!r} {y!r} {z!r}" for x, y, z in normals]
    for corners in draw(st.lists(st.lists(corner, min_size=3, max_size=6), min_size=1, max_size=6)):
        form = draw(st.sampled_from(["{0}", "{0}/7", "{0}//{1}", "{0}/7/{1}"] if normals else ["{0}", "{0}/7"]))
        statement = draw(st.sampled_from(["", "g part", "# remark", *(f"usemtl {name}" for name in NAMES)]))
        lines += [statement, "f " + " ".join(form.format(*c) for c in corners)]
    blank = draw(st.sampled_from([" ", "  ", "\t"]))
    return "mtllib m.mtl\n" + "\n".join(lines).replace(" ", blank) + draw(st.sampled_from(["", "\n"]))


def check_against_oracle(path):
    mesh, expected = read_obj(path), tiny_obj.read_obj(path)
    assert np.array_equal(mesh.vertices, expected.vertices)
    assert np.array_equal(np.signbit(mesh.vertices), np.signbit(expected.vertices))
    assert np.array_equal(mesh.faces, expected.triangles())
    names = [mesh.materials[k].name for k in mesh.face_materials]
    assert names == [name or "default" for name in expected.triangle_materials()]
    fans = [ids or [-1] * len(p) for p, ids in zip(expected.polygons, expected.normal_ids, strict=True)]
    normal_ids = replace(expected, polygons=fans).triangles()
    if (normal_ids >= 0).any():
        assert np.array_equal(mesh.normals, expected.normals)
        assert np.array_equal(mesh.face_normals, normal_ids)
    else:
        assert len(mesh.normals) == len(mesh.face_normals) == 0


@settings(derandomize=True, max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=obj_texts())
def test_random_files_agree_with_the_oracle(tmp_path, text):
    (tmp_path / "m.mtl").write_text("".join(f"newmtl {name}\n" for name in NAMES))
    (tmp_path / "mesh.obj").write_text(text)
    with pytest.MonkeyPatch.context() as patch:  # the oracle knows fans only
        patch.setattr("taichi_tracer.files.readers.obj.triangulate", lambda points, sizes, ids: fan(sizes))
        check_against_oracle(tmp_path / "mesh.obj")


@pytest.mark.parametrize(("name", "triangles"), [("cheburashka.obj", 13334), ("rocker-arm.obj", 20088)])
def test_real_meshes_agree_with_the_oracle(name, triangles):
    path = data_file(name)
    check_against_oracle(path)
    assert len(read(path).faces) == triangles


@pytest.mark.parametrize("scale", [1, 255])
def test_colours_of_all_vertices_are_linear_afterwards(obj, scale):
    """They are sRGB in the file, from 0 to 1 or to 255; they take the place of the usual grey, and multiply Kd."""
    text = "".join(f"v {i} {i * i} 0 {scale} {scale / 2:g} 0\n" for i in range(3))
    mesh = obj(f"{text}f 1 2 3\n")
    np.testing.assert_allclose(mesh.corner_color, np.broadcast_to([1, 0.2140411, 0], (1, 3, 3)), rtol=1e-5)
    assert mesh.materials == [Material(Kd=(1, 1, 1))]
    mesh = obj(f"mtllib m.mtl\n{text}usemtl a\nf 1 2 3\n", m="newmtl a\nKd 0.5 0.5 0.5\n")
    assert mesh.materials[0].Kd == (0.5, 0.5, 0.5)


def test_texture_coordinates_are_those_of_each_corner(obj, tmp_path):
    """Where a corner has none, they are 0; an index out of range is told with its line."""
    np.save(tmp_path / "a.npy", np.ones((1, 1, 3)))
    text = SQUARE + "mtllib m.mtl\nusemtl a\nvt 0.25 0.5\nvt 1 2 0\n"
    mesh = obj(f"{text}f 1/1 2/2 3\nf 1/-1 3/-2 4/2\n", m="newmtl a\nmap_Kd a.npy\n")
    assert mesh.corner_uv.tolist() == [[[0.25, 0.5], [1, 2], [0, 0]], [[1, 2], [0.25, 0.5], [1, 2]]]
    with pytest.raises(InputError, match=r"mesh.obj:9: texture coordinate index 3 is out of range \(the file has 2"):
        obj(f"{text}f 1/1 2/2 3/3\n", m="newmtl a\nmap_Kd a.npy\n")
    assert obj(f"{text}f 1/1 2/2 3/3\n", m="newmtl a\n").corner_uv is None  # nobody looks at them
