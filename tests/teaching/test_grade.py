"""Grading: marks of a class, whatever its submissions do; on a small assignment in plain Python."""

import numpy as np
import pytest
from teaching import sums

from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.grading import grade as grading


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder, in which the cache of these tests is, too."""
    folder = tmp_path_factory.mktemp("grade")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TAICHI_TRACER_CACHE", str(folder / "cache"))
        yield folder


@pytest.fixture(scope="module")
def assignment(place):
    """The small assignment."""
    return catalogue.load(sums.write_assignment(place / "sums"))


def test_what_a_stranger_says_cannot_change_a_terminal():
    assert grading.clean("a\x1b[2J\r\nb\u202e") == "a\N{REPLACEMENT CHARACTER}[2J" + "\N{REPLACEMENT CHARACTER}" * 2 + (
        "b\N{REPLACEMENT CHARACTER}"
    )
    assert len(grading.clean("x" * 1000)) == grading.LONGEST_MESSAGE


@pytest.mark.parametrize(
    "answers",
    [
        {},
        {"value": np.zeros((2, 2))},
        {"value": np.full(20, np.nan)},
        {"value": np.zeros(20, bool)},
        {"value": np.array(1)},
        {"other": np.zeros(20)},
        {"value": np.zeros((0,) * 8)},
    ],
)
def test_any_answer_has_a_verdict(answers, assignment):
    part = assignment.parts[0]
    inputs = assignment.inputs(part, 1)
    verdict = grading.judged(part, inputs, answers, {"value": inputs["a"] + inputs["b"]})
    assert verdict.status in ("wrong", "crashed")
    assert verdict.share == 0
