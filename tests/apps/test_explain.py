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
