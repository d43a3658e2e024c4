"""The mistake finder: every mistake is found under its name, pairs mostly, and right answers are never named.

TAICHI_TRACER_LONG=1 runs it for every part of every assignment.
"""

import itertools

import numpy as np
import pytest
from teaching.variants import VARIANTS

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue, mistakes, sketches
from taichi_tracer.teaching.base import mistake
from taichi_tracer.teaching.cutting import solved, stub_of
from taichi_tracer.teaching.kept import arrays_in, parted
from taichi_tracer.teaching.loading import OK, solution_of
from taichi_tracer.teaching.mistakes import find, split_at_method, with_mistakes
from taichi_tracer.teaching.running import answer, expected

# Pairs of names of which no input can tell which one it is, and why.
ALIKE = [
    # u, v and t of a hit on the back have the wrong sign, so that only hits behind the origin would differ.
    {"one-sided test: det > epsilon", "absolute value of det in the quotients"}
]
QUICK = ("Camera.generate_ndc_coords", "RayIntersector.query_ray")
PARTS = [(name, part.name) for name in catalogue.names() for part in catalogue.load(name).parts if part.replaces]
EVERY = [pytest.param(*ids, marks=[] if ids[1] in QUICK and ids[0] == "a1" else pytest.mark.long) for ids in PARTS]


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


def variant_classes(assignment, part, body):
    """The solution with another body of one method."""
    file = assignment.classes[part.replaces]
    source = (assignment.solution_folder / file).read_text(encoding="utf-8")
    before, _, after = split_at_method(solved(source, file), part.replaces, part.method, file)
    return mistakes.load_text(assignment, file, before + body + after)


@pytest.mark.exhaustive
@pytest.mark.parametrize(("name", "part_name"), PARTS)
@pytest.mark.parametrize("body", ["stub", "pass", "return None", "return 0.0", "return 1.0"])
def test_a_method_that_computes_nothing_earns_nothing(name, part_name, body):
    """Neither the stub without its mark, nor a body without an answer; and the process goes on."""
    assignment = catalogue.load(name)
    part = assignment.part(part_name)
    file = assignment.classes[part.replaces]
    stub = stub_of((assignment.solution_folder / file).read_text(encoding="utf-8"), file)
    lines = split_at_method(stub, part.replaces, part.method, file)[1].splitlines(keepends=True)
    text = "".join(line for line in lines if "not_written" not in line) if body == "stub" else f"        {body}\n"
    inputs = assignment.inputs(part, 3)
    found = answer(part, variant_classes(assignment, part, text), solution_of(assignment), inputs)
    if found.status == OK:
        assert part.judge(inputs, found.arrays, expected(assignment, part, inputs)).share == 0


VARIANT_PARTS = [
    (name, variant, part) for name, found in VARIANTS.items() for variant, parts in found.items() for part in parts
]


@pytest.mark.parametrize(
    ("name", "variant", "part_name"),
    [pytest.param(*ids, marks=[] if ids == VARIANT_PARTS[0] else pytest.mark.long) for ids in VARIANT_PARTS],
)
def test_right_solutions_that_are_written_differently_are_right(name, variant, part_name):
    """For three seeds of the inputs."""
    assignment = catalogue.load(name)
    part = assignment.part(part_name)
    classes = variant_classes(assignment, part, VARIANTS[name][variant][part_name])
    for seed in range(3):
        inputs = assignment.inputs(part, seed)
        found = answer(part, classes, solution_of(assignment), inputs, dict(assignment.classes))
        assert found.status == OK, found.message
        right = expected(assignment, part, inputs)
        verdict = part.judge(inputs, found.arrays, right)
        assert verdict.status == "right", (seed, verdict.message, verdict.first_wrong)
        assert find(assignment, part, inputs, found.arrays, right) == []


@pytest.mark.parametrize("name", catalogue.names())
def test_every_part_is_also_written_differently(name):
    """By five students for an assignment, and by some of them for each method."""
    tested = [part.name for part in catalogue.load(name).parts if part.replaces]
    count = {part: sum(part in written for written in VARIANTS[name].values()) for part in tested}
    assert len(VARIANTS[name]) >= 5
    assert min(count.values()) >= (1 if name in ("a1", "a2") else 3), count


@pytest.mark.long
@pytest.mark.parametrize("part_name", ["Camera.generate_ndc_coords", "Camera.generate_camera_coords"])
def test_most_pairs_are_found(part_name):
    """All pairs that can be made of the mistakes of two parts."""
    share, told = pairs_found("a1", part_name, 1)
    assert share >= 0.7, told


@pytest.mark.exhaustive
@pytest.mark.parametrize(("name", "part_name"), PARTS)
def test_most_pairs_are_found_in_every_part(name, part_name):
    """A tenth of all pairs."""
    share, told = pairs_found(name, part_name, 10)
    assert share >= 0.7, told


def pairs_found(name, part_name, every):
    """(the share of pairs that are found, those that are not)."""
    assignment = catalogue.load(name)
    part = assignment.part(part_name)
    inputs = assignment.inputs(part, 3)
    right = expected(assignment, part, inputs)
    single = [answers_with(assignment, part, (one,), inputs) for one in assignment.mistakes_of(part)]
    found, missed = 0, []
    for pair in list(itertools.combinations(assignment.mistakes_of(part), 2))[::every]:
        wrong = answers_with(assignment, part, pair, inputs)
        alone = [a for a in single if a is not None and wrong is not None and part.judge.agrees(inputs, wrong, a).all()]
        if wrong is None or alone or part.judge.agrees(inputs, wrong, right).all():
            continue  # they exclude each other, or one hides the other, or they cancel
        names = [set(finding.names) for finding in find(assignment, part, inputs, wrong, right)]
        if {one.name for one in pair} in names:
            found += 1
        else:
            missed.append([one.name for one in pair])
    return (found / (found + len(missed)) if found + len(missed) else 1.0), missed


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


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name == "rt3" else pytest.mark.long) for name in catalogue.names()]
)
def test_a_mistake_is_compared_first_by_its_sketch(name):
    """Every known mistake has a sketch; ``sketches.write`` makes them anew."""
    assignment = catalogue.load(name)
    for part in assignment.parts:
        inputs, known = assignment.inputs(part, sketches.SEED), assignment.mistakes_of(part)
        for one in known:
            wrong = mistakes.answers_of(assignment, part, (one,), inputs)
            first = sketches.likely_first(assignment, part, inputs, wrong, known)[0]
            assert first is one or {first.name, one.name} in ALIKE


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
