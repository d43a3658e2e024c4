"""The mistake finder: every mistake is found under its name, pairs mostly, and right answers are never named.

TAICHI_TRACER_LONG=1 runs it for every part of every assignment.
"""

import numpy as np
import pytest
from teaching.variants import VARIANTS

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue, mistakes, sketches
from taichi_tracer.teaching.base import mistake
from taichi_tracer.teaching.kept import arrays_in, parted
from taichi_tracer.teaching.loading import OK, solution_of
from taichi_tracer.teaching.mistakes import find, with_mistakes
from taichi_tracer.teaching.running import answer, expected

# Pairs of names of which no input can tell which one it is, and why.
ALIKE = [
    # u, v and t of a hit on the back have the wrong sign, so that only hits behind the origin would differ.
    {"one-sided test: det > epsilon", "absolute value of det in the quotients"}
]
QUICK = ("Camera.generate_ndc_coords", "RayIntersector.query_ray")
PARTS = [(name, part.name) for name in catalogue.names() for part in catalogue.load(name).parts if part.replaces]
EVERY = [ids for ids in PARTS if ids[1] in QUICK and ids[0] == "a1"]


pytestmark = pytest.mark.usefixtures("own_cache")


def answers_with(assignment, part, combination, inputs):
    """What the solution with some mistakes answers."""
    classes = with_mistakes(assignment, part, combination)
    if classes is None:
        return None
    found = answer(part, classes, solution_of(assignment), inputs, dict(assignment.classes))
    return found.arrays if found.status == OK else None


@pytest.mark.parametrize(("name", "part_name"), EVERY)
def test_every_mistake_is_found_under_its_own_name(name, part_name):
    assignment = catalogue.load(name)
    part = assignment.part(part_name)
    inputs = assignment.inputs(part, 1)
    right = expected(assignment, part, inputs)
    for one in assignment.mistakes_of(part):
        wrong = answers_with(assignment, part, (one,), inputs)
        assert part.judge(inputs, wrong, right).status == "wrong", one.name
        names = {n for finding in find(assignment, part, inputs, wrong, right) for n in finding.names}
        assert one.name in names
        assert len(names) == 1 or names in ALIKE, names


@pytest.mark.parametrize(("name", "part_name"), EVERY)
def test_nothing_is_found_in_the_solution(name, part_name):
    assignment = catalogue.load(name)
    part = assignment.part(part_name)
    inputs = assignment.inputs(part, 2)
    right = expected(assignment, part, inputs)
    assert part.judge(inputs, right, right).status == "right"
    assert find(assignment, part, inputs, right, right) == []


@pytest.mark.parametrize("name", catalogue.names())
def test_every_part_is_also_written_differently(name):
    """By five students for an assignment, and by some of them for each method."""
    tested = [part.name for part in catalogue.load(name).parts if part.replaces]
    count = {part: sum(part in written for written in VARIANTS[name].values()) for part in tested}
    assert len(VARIANTS[name]) >= 5
    assert min(count.values()) >= (1 if name in ("a1", "a2") else 3), count


def test_there_are_enough_mistakes():
    """At least 40, each with a hint that is a question or a sentence, and none twice."""
    every = [(a, m) for a in catalogue.names() for m in catalogue.load(a).mistakes]
    assert len(every) >= 40
    assert len({(a, m.part, m.name) for a, m in every}) == len(every)
    assert [m.name for _, m in every if not m.hint.rstrip().endswith(("?", "."))] == []


def test_every_change_has_its_place():
    """Each text that a mistake changes stands exactly once in its method."""
    for name in catalogue.names():
        assignment = catalogue.load(name)
        for one in assignment.mistakes:
            mistakes.changed_source(assignment, assignment.part(one.part), (one,))


def test_a_change_without_its_place_is_an_error():
    assignment = catalogue.load("a1")
    part = assignment.parts[0]
    with pytest.raises(InputError, match=r"mistake 'x': 'nonsense' stands 0 times in Camera.generate_ndc_coords"):
        mistakes.changed_source(assignment, part, (mistake(part.name, "x", "?", ("nonsense", "")),))


def test_an_error_that_no_mistake_explains_is_described():
    assignment = catalogue.load("a1")
    part = assignment.parts[0]
    inputs = assignment.inputs(part, 0)
    right = expected(assignment, part, inputs)
    found = find(assignment, part, inputs, {"ndc": right["ndc"] * np.float32(0.7)}, right, seconds=0)
    assert [f.names for f in found] == [(), ()]
    assert [f.text for f in found] == ["ndc is scaled by 0.7", "7 more known mistakes are compared in the next check"]


def test_two_changes_add_or_multiply():
    """The pair whose changes together give the student's numbers is the nearest."""
    right = np.array([1.0, 2, 3, 4])
    twice, moved, third = 2 * right, right + 1, right / 3
    assert mistakes.distance(2 * right + 1, right, twice, moved) == pytest.approx(0)
    assert mistakes.distance(2 * right / 3, right, twice, third) == pytest.approx(0)
    assert mistakes.distance(2 * right / 3, right, twice, moved) > 0.2
    assert mistakes.distance(right, right, np.full(4, np.nan), moved) == 1


def test_an_attempt_begins_only_if_it_may_end_in_time(monkeypatch):
    """An attempt may take as long as the longest one before it."""
    now = [100.0]
    monkeypatch.setattr(mistakes.time, "monotonic", lambda: now[0])
    clock = mistakes.TimeLimit(3.0)
    told = []
    while clock.has_time():
        with clock.running():
            now[0] += 0.8
        told.append(round(now[0] - 100, 3))
    assert told == [0.8, 1.6, 2.4]


def test_answers_are_kept_and_a_damaged_file_is_computed_again():
    assignment = catalogue.load("a1")
    part, inputs = assignment.parts[0], assignment.inputs(assignment.parts[0], 5)
    one = (assignment.mistakes_of(part)[0],)
    path = mistakes.kept_at(assignment, part, one, inputs)
    assert not path.exists()
    first = mistakes.answers_of(assignment, part, one, inputs)
    path.write_bytes(b"no zip")
    again = mistakes.answers_of(assignment, part, one, inputs)
    assert np.array_equal(first["ndc"], again["ndc"])
    assert path.read_bytes() != b"no zip"


def test_other_inputs_have_no_sketch():
    assignment = catalogue.load("rt3")
    part = assignment.parts[0]
    inputs, known = assignment.inputs(part, 5), assignment.mistakes_of(part)
    assert sketches.likely_first(assignment, part, inputs, {}, known) == list(known)


def test_what_is_missing_in_an_answer_does_not_matter_to_a_sketch():
    assignment = catalogue.load("rt3")
    part = assignment.parts[0]
    inputs, known = assignment.inputs(part, sketches.SEED), assignment.mistakes_of(part)
    for answers in ({}, {"matrix": np.float32(1)}, {"matrix": np.zeros((2, 3))}):
        assert set(sketches.likely_first(assignment, part, inputs, answers, known)) == set(known)


def test_every_mistake_has_a_sketch():
    for name in catalogue.names():
        assignment = catalogue.load(name)
        kept = parted(arrays_in(assignment.folder / sketches.FILE))
        told = {part: set(group[sketches.CHANGES]) for part, group in kept.items()}
        assert all(sketches.digest_of(one) in told[one.part] for one in assignment.mistakes), name
        for part in assignment.parts:
            if part.name in told:
                assert str(kept[part.name][sketches.INPUTS]) == sketches.digest(assignment.inputs(part, sketches.SEED))
