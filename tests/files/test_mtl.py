"""MTL files: every value in its field, and errors that name file and line."""

import numpy as np
import pytest

from taichi_tracer.files.images import save_image
from taichi_tracer.files.readers.mtl import find_library, read_mtl
from taichi_tracer.materials import Material
from taichi_tracer.system.errors import InputError


@pytest.fixture
def mtl(tmp_path):
    """Reads a text as the MTL file scene.mtl."""

    def read_text(text, notes=None):
        path = tmp_path / "scene.mtl"
        path.write_bytes(text.encode())
        return read_mtl(path, [] if notes is None else notes)

    return read_text


def test_every_value_goes_to_its_field(mtl):
    materials = mtl(
        "newmtl full\nKd .1 .2 .3\nKa 1 0 0\nKs 0 .5 0\nKe 10 20 30\nNs 50\nNi 1.5\nd .25\n"
        "alpha_x 0.1\nalpha_y 0.2\nF0 .7 .8 .9\nillum 2\n"
    )
    assert materials == {
        "full": Material(
            name="full",
            Kd=(0.1, 0.2, 0.3),
            Ka=(1, 0, 0),
            Ks=(0, 0.5, 0),
            Ke=(10, 20, 30),
            Ns=50,
            Ni=1.5,
            d=0.25,
            alpha_x=0.1,
            alpha_y=0.2,
            F0=(0.7, 0.8, 0.9),
            extra={"illum": (2.0,)},
        )
    }


def test_other_keys_are_kept_for_brdfs_that_read_them(mtl):
    """In lower case, with as many numbers as there are; words are left out."""
    (material,) = mtl("newmtl a\nRoughness .5\nsheen_tint 1 0.5 0\nmap_Kd wood.png\nNs 3\n").values()
    assert material.extra == {"roughness": (0.5,), "sheen_tint": (1.0, 0.5, 0.0)}
    assert material.value("roughness", 0.25) == 0.5
    assert material.value("sheen_tint", (0, 0, 0)) == (1, 0.5, 0)
    assert material.value("clearcoat", 0.25) == 0.25


@pytest.mark.parametrize(("line", "opacity"), [("d 0.25", 0.25), ("Tr 0.25", 0.75), ("d -halo 0.5", 0.5)])
def test_opacity_may_be_written_as_transparency(mtl, line, opacity):
    assert mtl(f"newmtl a\n{line}\n")["a"].d == opacity


@pytest.mark.parametrize("text", ["NEWMTL a\nkd 1 0 0\nNS 7\n", "\tnewmtl a\r\n  Kd\t1  0 0 # red\r\nNs \\\r\n7\r\n"])
def test_case_indents_comments_and_line_ends_do_not_matter(mtl, text):
    assert mtl(text) == {"a": Material(name="a", Kd=(1, 0, 0), Ns=7)}


@pytest.mark.parametrize(
    ("options", "wrap", "told"),
    [
        ("", "repeat", None),
        ("-clamp on", "clamp", None),
        ("-clamp off", "repeat", None),
        ("-s 2 2 -o 0.5 -blendu on", "repeat", "options of a texture are not used: -s, -o, -blendu"),
    ],
)
def test_a_texture_is_read_with_its_options(mtl, tmp_path, options, wrap, told):
    save_image(tmp_path / "a b.png", np.array([[[1.0, 0, 0], [0.5, 0.5, 0.5]]]), srgb=True)
    notes = []
    materials = mtl(f"newmtl a\nmap_Kd {options} a b.png\nnewmtl b\nmap_kd {options} a b.png # the same\n", notes)
    texture = materials["a"].map_Kd
    assert texture is materials["b"].map_Kd
    assert texture.wrap == (wrap, wrap)
    np.testing.assert_allclose(texture.pixels, [[[1, 0, 0], [0.5, 0.5, 0.5]]], atol=5e-3)
    assert [note.split("scene.mtl:2: ")[1] for note in notes[:1]] == ([] if told is None else [told])


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("missing.png", "missing.png: no such file"),
        ("broken.png", "broken.png"),
        ("unknown.tga", "unknown image type '.tga'"),
        ("", "the name of a file is missing"),
        ("-clamp on", "the name of a file is missing"),
        (".", "unknown image type ''"),
        ("folder.png", "folder.png: this is a folder: give a file in it"),
        ("/dev/zero", "/dev/zero"),
        ("a" * 5000 + ".png", "aaaa"),
    ],
)
def test_a_texture_that_cannot_be_read_is_told_with_its_line(mtl, tmp_path, name, why):
    (tmp_path / "broken.png").write_bytes(b"no picture")
    (tmp_path / "folder.png").mkdir()
    notes = []
    materials = mtl(f"newmtl a\nKd 1 0 0\nmap_Kd {name}\n", notes)
    assert materials["a"].map_Kd is None
    assert len(notes) == 1
    assert "scene.mtl:3: the texture is not used: " in notes[0]
    assert why in notes[0]
    assert "\n" not in notes[0]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("Kd 1 0", "Kd needs 1 or 3 numbers, not 2"),
        ("Kd 1 0 0 0", "Kd needs 1 or 3 numbers, not 4"),
        ("Ks", "Ks needs 1 or 3 numbers, not 0"),
        ("Kd red", "'red' is not a number"),
        ("Ke 1_0 0 0", "'1_0' is not a number"),
        ("Kd nan 0 0", "'nan' is not a number"),
        ("Ke 0 inf 0", "'inf' is not a number"),
        ("Ns 1 2", "Ns needs 1 number, not 2"),
        ("d -halo", "d needs 1 number, not 0"),
        ("alpha_x", "alpha_x needs 1 number, not 0"),
        ("alpha_y 1e999", "'1e999' is not a number"),
        ("alpha_x -0.1", "alpha_x must not be negative: -0.1"),
        ("alpha_y -1e-30", "alpha_y must not be negative: -1e-30"),
        ("alpha_x nan", "'nan' is not a number"),
        ("F0 1 2", "F0 needs 1 or 3 numbers, not 2"),
        ("F0 0.5 -0.5 0.5", "F0 must not be negative: 0.5 -0.5 0.5"),
        ("Kd -1 0 0", "Kd must not be negative: -1 0 0"),
        ("Kd 0x10", "'0x10' is not a number"),
        ("Kd 1,0,0", "'1,0,0' is not a number"),
        ("Kd spectral a.rfl", "'spectral' is not a number"),
    ],
)
def test_wrong_values_name_file_and_line(mtl, line, message):
    with pytest.raises(InputError, match=rf"scene\.mtl:5: {message}"):
        mtl(f"# comment\nnewmtl a\nNs \\\n1\n{line}\nKd 1 1 1\n")


@pytest.mark.parametrize(
    ("statement", "found"),
    [
        ("a.mtl", ["a.mtl"]),
        ("my scene.mtl", ["my scene.mtl"]),
        ("my scene.mtl # remark", ["my scene.mtl"]),
        ("a.mtl my.mtl", ["a.mtl", "my.mtl"]),
        ("sub\\b.mtl", ["sub/b.mtl"]),
        ("#1 # 2.mtl", ["#1 # 2.mtl"]),
    ],
)
def test_libraries_are_found_beside_the_mesh(tmp_path, statement, found):
    (tmp_path / "sub").mkdir()
    for name in ("a.mtl", "my.mtl", "my scene.mtl", "sub/b.mtl", "#1 # 2.mtl"):
        (tmp_path / name).touch()
    assert find_library(statement, tmp_path / "mesh.obj", "") == [tmp_path / name for name in found]
