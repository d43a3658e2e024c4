"""PLY files without trimesh, and strips: every encoding gives the triangles that it means, with one orientation."""

import struct
import sys

import numpy as np
import pytest

from taichi_tracer.files import meshes, read
from taichi_tracer.files.ply import plain_triangles, triangles_of, without_strips
from taichi_tracer.system.errors import InputError

# A square of four triangles around its middle, and a triangle of its own; the middle is vertex 4.
VERTICES = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 0), (2, 0, 0), (3, 0, 0), (2, 1, 0)]
STRIP = [0, 1, 4, 2, -1, 3, 4, 2, -1, 5, 6, 7]  # 0 1 4, 4 1 2 | 3 4 2 | 5 6 7
HEADER = """ply
format {format} 1.0
comment vertex_indices of tristrips
element vertex 8
property float x
property float y
property float z
{more}element tristrips {rows}
property list {count} {kind} vertex_indices
end_header
"""
COUNTS = {"int": "i", "uint": "I", "uchar": "B"}


def text(strips, more="", rows=None):
    header = HEADER.format(format="ascii", more=more, rows=rows or len(strips), count="int", kind="int")
    lines = [" ".join(map(str, vertex)) for vertex in VERTICES]
    lines += [" ".join(map(str, [len(strip), *strip])) for strip in strips]
    return ("\n".join([header + lines[0], *lines[1:]]) + "\n").encode()


def binary(strips, order="<", count="int", kind="int", more="", extra=b""):
    name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    header = HEADER.format(format=name, more=more, rows=len(strips), count=count, kind=kind).encode()
    body = np.asarray(VERTICES, f"{order}f4").tobytes() + extra
    for strip in strips:
        numbers = [number % 2**32 if kind == "uint" else number for number in strip]
        body += struct.pack(f"{order}{COUNTS[count]}{len(strip)}{COUNTS[kind]}", len(strip), *numbers)
    return header + body


@pytest.fixture
def mesh_of(tmp_path):
    def read_bytes(content):
        (tmp_path / "scan.ply").write_bytes(content)
        return read(tmp_path / "scan.ply")

    return read_bytes


def test_strips_alternate_begin_again_and_leave_out_repeated_ids():
    assert triangles_of(np.array(STRIP)).tolist() == [[0, 1, 4], [4, 1, 2], [3, 4, 2], [5, 6, 7]]
    assert triangles_of(np.array([0, 1, 2, 3, 4, 5])).tolist() == [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]]
    assert triangles_of(np.array([0, 1, 2, 2, 5, 5, 6, 7])).tolist() == [[0, 1, 2], [6, 5, 7]]
    assert triangles_of(np.array([-1, -1, 0, 1, -1, 2, -1])).tolist() == []
    assert triangles_of(np.array([], np.int64)).shape == (0, 3)


@pytest.mark.parametrize(
    "content",
    [
        text([STRIP]),
        binary([STRIP]),
        binary([STRIP], ">"),
        binary([STRIP], "<", "uchar", "int"),
        binary([STRIP], ">", "uint", "uint"),
        text([[0, 1, 4, 2], [3, 4, 2], [5, 6, 7]]),
        binary([[0, 1, 4, 2], [3, 4, 2], [], [5, 6, 7]], ">"),
    ],
    ids=["text", "little", "big", "uchar counts", "unsigned", "text, three lists", "big, four lists"],
)
def test_every_encoding_gives_the_triangles_of_the_strips(mesh_of, content):
    """All of them face +z here; so do those of the file."""
    mesh = mesh_of(content)
    assert mesh.faces.tolist() == [[0, 1, 4], [4, 1, 2], [3, 4, 2], [5, 6, 7]]
    assert mesh.vertices.tolist() == [list(map(float, vertex)) for vertex in VERTICES]
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[[0, 1, 3], 2] > 0).all()


def test_other_elements_may_stand_before_the_strips(mesh_of):
    more = "element face 0\nproperty list uchar int vertex_indices\n"
    more += "element range_grid 2\nproperty list uchar int vertex_indices\nproperty uchar flag\n"
    extra = struct.pack("<BiBBB", 1, 7, 0, 0, 1)
    assert len(mesh_of(binary([STRIP], more=more, extra=extra)).faces) == 4


def test_a_file_without_strips_is_returned_as_it_is():
    content = text([STRIP]).replace(b"element tristrips", b"element something")
    assert without_strips(content) is content
    assert without_strips(b"no header") == b"no header"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (binary([STRIP])[:-1], "cut short: it ends within its 1 rows of tristrips"),
        (binary([STRIP])[:-60], "cut short: it ends within its 8 rows of vertex"),
        (text([STRIP], rows=2), "cut short: it ends within its 2 rows of tristrips"),
        (text([STRIP]).replace(b"12 0 1", b"13 0 1"), "cut short: it ends within its 1 rows of tristrips"),
        (
            text([STRIP], more="element face 1\nproperty list uchar int vertex_indices\n"),
            "polygons and triangle strips",
        ),
        (text([[0, 1]]), "no triangles"),
        (text([[0, 1, 2, -2, 3, 4, 5]]), "vertex index -2"),
        (text([[0, 1, 8]]), "vertex index 8"),
    ],
)
def test_what_cannot_be_used_is_one_line(mesh_of, content, message):
    import taichi_tracer as tt
    from taichi_tracer.geometry import check

    with pytest.raises(tt.InputError, match=message) as caught:
        check(mesh_of(content))
    assert isinstance(caught.value, InputError)
    assert "\n" not in str(caught.value)


CORNERS = np.array([[0, 0, 0], [1, -0.0, 0], [1, 1, 0.1], [0, 1, 1e-30]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def ply(order="<", number="f4", count="u1", index="i4", counts=(3, 3), axes="xyz", lists="vertex_indices", more=b""):
    """A PLY file of two triangles."""
    types = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int", "u4": "uint32", "u2": "ushort"}
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    head = f"ply\nformat {form} 1.0\ncomment by hand\nelement vertex {len(CORNERS)}\n"
    head += "".join(f"property {types[number]} {axis}\n" for axis in axes)
    head += f"element face 2\nproperty list {types[count]} {types[index]} {lists}\nend_header\n"
    rows = np.zeros(2, [("count", order + count), ("ids", order + index, 3)])
    rows["count"], rows["ids"] = counts, HALVES
    return head.encode() + CORNERS.astype(order + number).tobytes() + rows.tobytes() + more


PLAIN = {
    "usual": {},
    "big-endian": {"order": ">"},
    "in f64": {"number": "f8"},
    "other integers": {"count": "u4", "index": "u2"},
    "other name": {"lists": "vertex_index"},
}
OTHERS = {
    "quads": {"counts": (4, 3)},
    "other axes": {"axes": "xzy"},
    "other list": {"lists": "texcoord"},
    "too long": {"more": b"0"},
}


@pytest.mark.parametrize("name", PLAIN)
def test_the_mesh_is_that_of_trimesh(name, tmp_path, monkeypatch):
    path = tmp_path / "a.ply"
    path.write_bytes(ply(**PLAIN[name]))
    found = read(path)
    monkeypatch.setattr(meshes, "plain_triangles", lambda raw: None)
    wanted = read(path)
    for member in ("vertices", "faces", "normals", "face_normals", "face_materials"):
        a, b = getattr(found, member), getattr(wanted, member)
        np.testing.assert_array_equal(a, b)
        assert a.dtype == b.dtype
    assert not np.signbit(found.vertices).any()
    assert (found.materials, found.source, found.notes) == (wanted.materials, wanted.source, wanted.notes)


def test_trimesh_is_not_asked(tmp_path, monkeypatch):
    (tmp_path / "a.ply").write_bytes(ply())
    monkeypatch.setitem(sys.modules, "trimesh", None)  # importing it would fail
    assert len(read(tmp_path / "a.ply").faces) == 2


@pytest.mark.parametrize("name", OTHERS)
def test_other_files_are_left_to_trimesh(name):
    assert plain_triangles(ply(**OTHERS[name])) is None


@pytest.mark.parametrize("length", range(0, len(ply()), 7))
def test_a_file_that_is_cut_short_is_left_to_trimesh(length):
    assert plain_triangles(ply()[:length]) is None


@pytest.mark.parametrize("word", [b"vertex 4", b"face 2", b"float", b"uchar", b"binary_little_endian", b"format"])
def test_a_damaged_header_is_left_to_trimesh(word):
    assert plain_triangles(ply().replace(word, b"wrong", 1)) is None
