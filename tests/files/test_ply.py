"""PLY files: every encoding gives the same triangles, and what cannot be used is one line."""

import struct

import numpy as np
import pytest

from taichi_tracer.files import read
from taichi_tracer.system.errors import InputError

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
HEADER = """ply
format {format} 1.0
element vertex {vertices}
property float x
property float y
property float z
element face {faces}
property uchar flags
property list uchar {kind} vertex_indices
end_header
"""
NAMES = {"<": "binary_little_endian", ">": "binary_big_endian"}


def ply(order, polygons, kind="int", vertices=4):
    header = HEADER.format(format=NAMES.get(order, "ascii"), vertices=vertices, faces=len(polygons), kind=kind)
    if not order:
        rows = [*POINTS, *((7, len(ids), *ids) for ids in polygons)]
        return (header + "".join(" ".join(map(str, row)) + "\n" for row in rows)).encode()
    body = np.asarray(POINTS, f"{order}f4").tobytes()
    code = {"int": "i", "ushort": "H"}[kind]
    return header.encode() + body + b"".join(struct.pack(f"{order}BB{len(i)}{code}", 7, len(i), *i) for i in polygons)


@pytest.fixture
def mesh_of(tmp_path):
    def read_bytes(content):
        (tmp_path / "scan.ply").write_bytes(content)
        return read(tmp_path / "scan.ply")

    return read_bytes


@pytest.mark.parametrize("kind", ["int", "ushort"])
@pytest.mark.parametrize("order", ["", "<", ">"])
@pytest.mark.parametrize("polygons", [[(0, 1, 2), (2, 3, 0)], [(0, 1, 2, 3), (2, 1, 0)], [(2, 1, 0), (0, 1, 2, 3)]])
def test_every_encoding_gives_the_same_triangles(mesh_of, order, kind, polygons):
    mesh = mesh_of(ply(order, polygons, kind))
    assert mesh.vertices.tolist() == [list(map(float, point)) for point in POINTS]
    fans = [[ids[0], ids[k], ids[k + 1]] for ids in polygons for k in range(1, len(ids) - 1)]
    assert (mesh.faces.tolist(), mesh.notes) == (fans, [])


GOOD = ply("<", [(0, 1, 2)])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (GOOD[:-1], "it announces 1 rows of face and has 0"),
        (GOOD.replace(b"vertex 4", b"vertex 9"), "it announces 9 rows of vertex and has"),
        (ply("", [(0, 1, 9)]), "a face has vertex 9, and there are 4"),
        (ply("", [(0, 1, -1)]), "a face has vertex -1"),
        (ply("", [(0, 1, "x")]), "could not convert string to float"),
        (GOOD.replace(b"float x", b"half x"), "the line 'property half x' of the header cannot be read"),
        (GOOD.replace(b"float x", b"float a"), "vertices need x, y and z"),
        (GOOD.replace(b"end_header", b"end"), "its header must end with end_header"),
        (GOOD.replace(b"binary_little", b"binary_middle"), "of the header cannot be read"),
        (GOOD.replace(b"face", b"tristrips"), "strips are not read"),
    ],
)
def test_what_cannot_be_used_is_one_line(mesh_of, content, message):
    with pytest.raises(InputError, match=message) as caught:
        mesh_of(content)
    assert "\n" not in str(caught.value)
    assert "scan.ply: cannot be read as PLY" in str(caught.value)
