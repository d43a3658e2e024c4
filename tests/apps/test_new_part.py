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
    assert f"my_{kind}" in told
    render = shlex.split(lines[2])
    assert main([*render[1:], "--size", "16x12"]) == 0
    assert (tmp_path / f"my_{kind}.png").exists()
