"""The page of a study: every chart labelled where it is, no number that is a power of ten, no file beside it."""

import json
import re

import numpy as np
import pytest
from made_up_study import made_curve, made_study, made_truth, shown

from taichi_tracer.studies import accuracy_report
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


def test_files_agree(study):
    made = accuracy_report.contents(study)
    assert set(made) == set(accuracy_report.FILES)
    content = json.loads(made["accuracy.json"])
    assert content["kernels_compiled"] == 30
    rows = made["accuracy.csv"].decode().splitlines()
    assert len(rows) == 1 + sum(int(np.isfinite(c.errors).sum()) for c in study.curves)
    assert made["accuracy.svg"].startswith(b"<svg")
