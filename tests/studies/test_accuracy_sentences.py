"""The words of a study: numbers in sentences, and what a knob's new setting is called."""

import math
from string import Formatter

import pytest
from made_up_study import made_curve, made_study

from taichi_tracer.studies import accuracy_sentences, accuracy_tables
from taichi_tracer.studies.accuracy_sentences import CLAUSES, told
from taichi_tracer.studies.variants import Variant


def test_a_time_that_is_hardly_longer_is_not_once_as_long():
    told = [accuracy_sentences.times_as_long(ratio) for ratio in (1.0, 1.04, 1.2, 3.14, 12.3, 1234.5)]
    assert told[:2] == ["about as long"] * 2
    assert told[2:] == [f"{ratio} times as long" for ratio in ("1.2", "3.1", "12", "1,234")]


def test_numbers_become_words_where_they_stand():
    rows = [{"variant": name, "best error": 0.015, "after s": 2.0} for name in ("mis", "brdf")]
    words = told(["missed"], {"target": 0.01, "missed": rows})
    assert (
        words
        == "Others did not reach 1 % in the time that they had: mis came to 1.5 % in 2 s; brdf came to 1.5 % in 2 s"
    )
    row = {"bounces": 1, "missing light": 0.2, "standard error": 0.01, "time": 0.125, "most": 8}
    assert told(["bounces"], row).startswith(
        "Paths of at most 1 bounce miss 20 % of the light, with a standard error of 1 %"
    )
    assert told(["bounces"], row | {"bounces": 3}).startswith("Paths of at most 3 bounces miss")
    assert told(["alike"], {"alike": ["a", "b"]}) == "; the time of a and of b cannot be told from it"
    assert [accuracy_sentences.show(v) for v in (math.nan, 1.2345, 7, "brdf")] == ["?", "1.23", "7", "brdf"]


@pytest.mark.parametrize("name", CLAUSES)
def test_no_clause_ends_a_sentence_by_itself(name):
    assert not CLAUSES[name].endswith((".", " "))
    assert all(field != "" for _, field, _, _ in Formatter().parse(CLAUSES[name]))


@pytest.mark.parametrize(
    ("knob", "settings", "subject"),
    [
        ("adaptive", (True, False), "No adaptive sampling"),
        ("plain", (True, False), "The fast code (fast forms)"),
        ("scale", (1.0, 0.25), "The resolution x 0.25"),
        ("scale", (1.0, 0.5), "Half of the resolution"),
        ("fast_math", (False, True), "Fast math"),
    ],
)
def test_a_knob_is_named_by_its_new_setting(knob, settings, subject):
    """Whichever setting is the first one."""
    first, second = (made_curve(variant=Variant(**{knob: value})) for value in settings)
    assert any(s.startswith(subject) for s in accuracy_tables.summary(made_study(first, second)))
