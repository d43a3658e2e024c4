"""Plain binary PLY files have the same vertices and triangles as trimesh finds in them; other files are left to it."""

import sys

import numpy as np
import pytest

from taichi_tracer.files import meshes, read
from taichi_tracer.files.ply_arrays import plain_triangles

VERTICES = np.array([[0, 0, 0], [1, -0.0, 0], [1, 1, 0.1], [0, 1, 1e-30]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def ply(order="<", number="f4", count="u1", index="i4", counts=(3, 3), axes="xyz", lists="vertex_indices", more=b""):
    """A PLY file of two triangles."""
    types = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int", "u4": "uint32", "u2": "ushort"}
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    head = f"ply\nformat {form} 1.0\ncomment by hand\nelement vertex {len(VERTICES)}\n"
    head += "".join(f"property {types[number]} {axis}\n" for axis in axes)
    head += f"element face 2\nproperty list {types[count]} {types[index]} {lists}\nend_header\n"
    rows = np.zeros(2, [("count", order + count), ("ids", order + index, 3)])
    rows["count"], rows["ids"] = counts, FACES
    return head.encode() + VERTICES.astype(order + number).tobytes() + rows.tobytes() + more


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
