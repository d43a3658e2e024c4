"""Each part that ``new-part`` writes is short, well formatted, right, and shown by its command."""

import shlex
import subprocess
import sys

import pytest
import taichi as ti
import taichi.math as tm
from support import long_except

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.apps.new_part import FOLDER, SHOWN, text_of
from taichi_tracer.system.registry import PARTS, load_parts

MOST_LINES = 40


QUICK = "light", "triangle_test", "intersector"


@pytest.mark.parametrize("kind", long_except(SHOWN, *QUICK))
def test_a_new_part_is_right(kind, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new-part", kind, f"my_{kind}"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "my_parts.py"
    text = (tmp_path / "my_parts.py").read_text()
    assert len(text.splitlines()) <= MOST_LINES
    check = shlex.split(lines[1])
    assert check == ["taichi-tracer", "check-part", "my_parts.py"]
    assert main(check[1:]) == 0
    told = capsys.readouterr().out
    assert "right" in told
    assert "WRONG" not in told
    assert f"my_{kind}" in (tmp_path / "my_parts.html").read_text()
    render = shlex.split(lines[2])
    assert main([*render[1:], "--size", "16x12"]) == 0
    assert (tmp_path / f"my_{kind}.png").exists()


def test_every_skeleton_belongs_to_a_kind():
    assert {path.stem for path in FOLDER.iterdir()} == set(SHOWN)


@pytest.mark.parametrize("kind", SHOWN)
def test_the_text_is_what_the_formatter_writes(kind):
    words = [sys.executable, "-m", "ruff", "format", "--line-length", "120", "-"]
    text = text_of(kind, "mine")
    done = subprocess.run(words, input=text, capture_output=True, text=True)
    if "No module named ruff" in done.stderr:
        pytest.skip("ruff is not installed")
    assert done.stdout == text


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["bdrf", "a"], "unknown kind of part 'bdrf': did you mean 'brdf'?"),
        (["brdf", "my-brdf"], "'my-brdf' is no name: it has letters, digits and _"),
        (["brdf", "class"], "'class' is no name"),
        (["brdf", "diffuse"], "the package has a brdf called diffuse: give yours another name"),
        (["view", "normal"], "the package has a view called normal"),
        (["tone", "mine", "-o", "mine.txt"], "mine.txt must end with .py"),
        (["tone", "mine", "-o", "there.py"], "there.py is there already"),
        (["tone", "mine", "-o", "none/mine.py"], "none"),
    ],
)
def test_what_cannot_be_written_is_one_line(words, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.py").write_text("x = 1\n")
    assert main(["new-part", *words]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1
    assert (tmp_path / "there.py").read_text() == "x = 1\n"


def test_names_of_several_words_become_a_class(tmp_path):
    (tmp_path / "parts.py").write_text(text_of("view", "edge_light_2"))
    (part,) = load_parts(str(tmp_path / "parts.py"))
    assert (type(part).__name__, part.name, part.label) == ("EdgeLight2", "edge_light_2", "Edge light 2")


def test_the_sky_has_its_sun_where_its_formula_says(tmp_path):
    (tmp_path / "parts.py").write_text(text_of("environment", "sunny"))
    load_parts(str(tmp_path / "parts.py"))
    sky = tt.load_scene_data("cube", environment="sunny").environment

    @ti.kernel
    def along(d: tm.vec3) -> tm.vec3:
        return sky.radiance(d)

    assert along(ti.Vector([0.48, 0.6, 0.64])).max() > 60
    assert along(ti.Vector([0.64, 0.6, 0.48])).max() < 1
    PARTS.remove(PARTS.find("environment", "sunny"))
