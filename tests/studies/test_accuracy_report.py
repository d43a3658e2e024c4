"""The page of a study: every chart labelled where it is, no number that is a power of ten, no file beside it."""

import itertools
import json
import math
import re

import numpy as np
import pytest
from made_up_study import made_curve, made_study, made_truth, shown
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from taichi_tracer.studies import accuracy_report, drawing, variants
from taichi_tracer.studies.variants import Variant

SCALES = {"mis": 0.02, "brdf": 0.2, "environment": 0.022}


def curve(variant, scale, per_sample=0.01):
    made = made_curve(-0.6, scale, per_sample, variant, 8, (0.9, 1.0, 1.1))
    made.shown, made.bias, made.seconds_to_save, made.compile_seconds = shown(1.0 + scale, 16, scale), 0.5, 1.5, 2.0
    return made


@pytest.fixture(scope="module")
def study():
    curves = [curve(Variant(name), scale) for name, scale in SCALES.items()]
    curves += [curve(Variant(sampler="independent"), 0.06), curve(Variant(precision="f64"), 0.02, 0.013)]
    made = made_study(*curves, side=16, start_seconds=1.2, kernels_made=30, seconds=59.0)
    made.truths["nearest"] = made_truth(np.ones((16, 16, 3)), 0.004)
    return made


@pytest.fixture(scope="module")
def html(study):
    return accuracy_report.as_html(study)


def test_the_page_needs_no_other_file_and_runs_on_a_phone_and_in_the_dark(html):
    assert not re.findall(r"(?:src|href)=['\"](?!data:|#)[^'\"]+", html)
    assert "name='viewport'" in html
    assert "prefers-color-scheme: dark" in html
    assert "@media print" in html
    assert html.count("<svg") == 6  # three charts, each for broad and for narrow screens
    assert html.count("class='sortable'") == 2


def test_labels_on_a_narrow_screen_are_short(study):
    """The first label of a colour names the estimator, the others their sampler; a broad screen has room for both."""
    broad, narrow = (
        re.findall(r">([^<>]+: [\d.]+ %)</text>", accuracy_report.chart_in(study, "curves", shape))
        for shape in accuracy_report.SHAPES
    )
    assert {text.partition(":")[0] for text in narrow} == {"mis", "brdf", "environment", "independent"}
    assert {text.partition(":")[0] for text in broad} >= {"mis, niederreiter", "mis, independent"}


@pytest.mark.parametrize("name", ["curves", "knobs", "wait"])
def test_a_telephone_shows_every_letter_of_a_chart_and_none_is_small(name):
    """On 390 pixels, of which the page leaves 15 free on each side."""
    pairs = enumerate(variants.plan())
    every = made_study(*(curve(v, 0.02 * 1.55**k, 0.01 + 0.001 * k) for k, v in pairs), side=16, start_seconds=1.2)
    figure, _ = accuracy_report.figure_of(every, name, "narrow")
    pixels = (390 - 2 * 15) / (72 * figure.get_figwidth())
    draw = FigureCanvasAgg(figure).get_renderer()
    figure.draw(draw)
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
    assert len(texts) > 8
    assert min(text.get_fontsize() for text in texts) * pixels >= 11
    boxes = {text.get_text(): Text.get_window_extent(text, draw) for text in texts}  # without its line
    whole = figure.bbox
    cut = [words for words, b in boxes.items() if b.x0 < 0 or b.y0 < 0 or b.x1 > whole.x1 or b.y1 > whole.y1]
    assert cut == []
    overlapping = [(a, b) for a, b in itertools.combinations(boxes, 2) if boxes[a].padded(-1).overlaps(boxes[b])]
    assert overlapping == []


def test_what_was_left_out_is_folded():
    folded = accuracy_report.folded("Not compared, because there was no time to compile them: a; b & c.")
    assert folded == (
        "<details><summary>Not compared, because there was no time to compile them</summary>a; b &amp; c.</details>"
    )
    assert accuracy_report.folded("To 2 % error: a < b.") == "To 2 % error: a &lt; b."


def test_identifiers_in_the_drawings_differ(html):
    clips = re.findall(r'<clipPath id="([^"]+)"', html)
    assert len(clips) == len(set(clips)) > 0


def test_points_tell_their_numbers_under_the_mouse(html):
    assert "<title>mis, niederreiter: " in html
    assert re.search(r"<title>brdf, niederreiter: [\d.]+ % after [\d.]+ s, 256 samples per pixel</title></use>", html)


def test_axes_are_in_percent_and_no_number_is_a_power_of_ten(study):
    svg = drawing.plain_svg(accuracy_report.draw(study), "x")
    words = re.findall(r">([^<>]+)</text>", svg)
    assert "5 %" in words
    assert any(re.fullmatch(r"[\d.]+ m?s", word) for word in words)
    assert not any("10^" in word or "mathdefault" in word or "e+" in word for word in words)
    for label in (
        "mis, niederreiter: ",
        "brdf, niederreiter: ",
        "mis, independent: ",
        "Float64",
        "independent numbers",
    ):
        assert any(word.startswith(label) for word in words), label


def test_error_maps_have_a_scale_and_pictures_are_large(html):
    assert "of the mean brightness, or more" in html
    assert "linear-gradient" in html
    assert f"width='{accuracy_report.SHOWN}'" in html


def test_the_wait_is_told_with_its_compilation(html):
    assert "1.2 s to start, 0.4 s to read the scene, 2.0 s to compile" in html
    assert "A second run finds the compiled kernels" in html


def test_files_agree(study):
    made = accuracy_report.contents(study)
    assert set(made) == set(accuracy_report.FILES)
    content = json.loads(made["accuracy.json"])
    assert content["kernels_compiled"] == 30
    rows = made["accuracy.csv"].decode().splitlines()
    assert len(rows) == 1 + sum(int(np.isfinite(c.errors).sum()) for c in study.curves)
    assert made["accuracy.svg"].startswith(b"<svg")


def test_what_was_not_reached_is_no_number(study):
    table = accuracy_report.table(accuracy_report.costs(study))
    assert "not reached" in table
    assert "about" not in table
    assert math.isnan(study.curves[1].seconds_to(0.01))
