"""Each part that ``new-part`` writes is short, well formatted, right, and shown by its command."""

import shlex

import pytest

from taichi_tracer.apps.cli import main

MOST_LINES = 40


QUICK = "light", "triangle_test", "intersector"


@pytest.mark.parametrize("kind", QUICK)
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
