"""``taichi-tracer explain``: text, JSON and a page; what is asked for wrongly is told in one line."""

import json

import pytest

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
