"""``taichi-tracer explain``: text, JSON and a page; what is asked for wrongly is told in one line."""

import json
import re

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.apps.cli import main

pytestmark = pytest.mark.usefixtures("f32")


def test_a_pixel_as_text_json_and_page(tmp_path, capsys):
    data, page = tmp_path / "pixel.json", tmp_path / "pixel.html"
    words = ["explain", "cube", "--size", "24x16", "--pixel", "12", "8", "--view", "hit"]
    assert main([*words, "--json", str(data), "--html", str(page)]) == 0
    text = capsys.readouterr().out
    assert text.startswith("pixel in column 12, row 8 from the top (x = 12, y = 7), sample 0: A1Renderer, hit\n")
    assert "a triangle is tried" in text
    found = json.loads(data.read_text(encoding="utf-8"))
    assert found["value"] == [1, 1, 1]
    assert found["steps"][0]["step"] == "random numbers"
    html = page.read_text(encoding="utf-8")
    assert "<details" in html
    assert "the ring is around column 12, row 8" in html
    assert "http" not in html.replace("http-equiv", "")


@pytest.mark.exhaustive
def test_the_worst_pixel_is_found(capsys):
    words = ["explain", "cube", "--environment", "studio", "--estimator", "uniform", "--size", "24x16", "--spp", "8"]
    assert main([*words, "--worst"]) == 0
    out, err = capsys.readouterr()
    assert "the largest standard error" in err
    assert "of 8 samples" in out
    scene = tt.load_scene_data("cube", environment="studio")
    renderer = tt.A3Renderer(scene, 24, 16).use("uniform").render(8)
    column, row = (int(word) for word in re.findall(r"column (\d+), row (\d+)", out)[0])
    values = np.array([renderer.explain(column, row, k).value for k in range(8)])
    farthest = int(abs(values - values.mean(axis=0)).sum(axis=1).argmax())
    assert f"sample {farthest}: " in out
    assert renderer.explain(column, row, None).sample == farthest
    assert main([*words, "--non-finite"]) == 0
    assert capsys.readouterr().out == "all 8 samples of every pixel are finite\n"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "explain needs one of --pixel X Y, --worst and --non-finite"),
        (["--pixel", "1", "1", "--worst"], "explain needs one of --pixel X Y, --worst and --non-finite"),
        (["--pixel", "24", "0"], "explain: the column must be from 0 to 23, not 24"),
        (["--pixel", "1", "1", "--view", "all"], "explain takes one picture"),
        (["--pixel", "1", "1", "--json", "/no/such/folder/x.json"], "/no/such/folder"),
    ],
)
def test_what_cannot_be_explained_is_told_in_one_line(words, message, capsys):
    assert main(["explain", "cube", "--size", "24x16", *words]) == 2
    err = capsys.readouterr().err.splitlines()
    assert message in err[-1]
    assert sum(line.startswith("taichi-tracer: error") for line in err) == 1


@pytest.mark.exhaustive
def test_a_sample_that_is_not_a_number_is_found(tmp_path, capsys):
    parts = tmp_path / "odd.py"
    parts.write_text(
        "import taichi as ti\nimport taichi.math as tm\nimport taichi_tracer as tt\n\n\n@tt.register\n"
        "class Odd(tt.View):\n    name, label = 'odd', 'Odd'\n\n    @ti.func\n    def color(self, hit):\n"
        "        return tm.vec3(hit.normal.x / (hit.normal.x - hit.normal.x))\n",
        encoding="utf-8",
    )
    words = ["explain", "cube", "--size", "24x16", "--parts", str(parts), "--view", "odd", "--non-finite"]
    assert main(words) == 0
    out, err = capsys.readouterr()
    assert "samples are not finite; the first is explained" in err
    assert "(∞, ∞, ∞)" in out
