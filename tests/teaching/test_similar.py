"""Submissions that are alike: copies under other names are found, independent solutions are not."""

import ast
from pathlib import Path

import pytest
from teaching import sums
from teaching.variants import FOLDER

from taichi_tracer.teaching import catalogue, similar
from taichi_tracer.teaching.cutting import solved, stub_of
from taichi_tracer.teaching.submissions import find

GIVEN = ("self", "ti", "tm", "tt", "np")


class Renamed(ast.NodeTransformer):
    """The same program, with other names of variables."""

    def visit_Name(self, node):
        return node if node.id in GIVEN else ast.Name(f"my_{node.id}", node.ctx)


def copied(text: str) -> str:
    """The same program with other names, without comments, in another layout."""
    return ast.unparse(Renamed().visit(ast.parse(text)))


@pytest.mark.parametrize("name", catalogue.names())
def test_of_independent_solutions_only_the_copies_are_listed(name):
    assignment = catalogue.load(name)
    texts = {p.stem: p.read_text() for p in Path(FOLDER).glob("*.py") if p.stem.rpartition("_")[0] == name}
    assert len(texts) == 5
    for copied_one in sorted(texts):
        all_of_them = texts | {"copy": copied(texts[copied_one]), similar.SOLUTION: solution(assignment, solved)}
        runs = {key: similar.runs_of({"a.py": text}) for key, text in all_of_them.items()}
        pairs = similar.pairs_of(runs, similar.runs_of({"a.py": solution(assignment, stub_of)}))
        assert [pair.keys for pair in pairs] == [(copied_one, "copy")]
        assert pairs[0].share == pytest.approx(1)


def solution(assignment, form) -> str:
    """The files of the solution in one text."""
    return "".join(form(text, file) for file, text in similar.solution_texts(assignment).items())


def test_what_was_handed_out_does_not_count():
    assignment = catalogue.load("a2")
    stubs = similar.runs_of({"a.py": solution(assignment, stub_of)})
    assert similar.pairs_of({"x": stubs, "y": stubs, "z": {}}, stubs) == []


def test_pairs_that_have_one_in_common_are_joined():
    shares = {("a", "b"): 1.0, ("c", "d"): 0.9, ("b", "e"): 0.6}
    joined = similar.groups_of([similar.Group(keys, share, ("f",)) for keys, share in shares.items()])
    assert {group.keys: group.share for group in joined} == {("c", "d"): 0.9, ("a", "b", "e"): 0.6}


LONG = """
total = [x * 2 for x in range(3)]
if total[0] > 1:
    total = sorted(total)[1:] + [len(total) - 1]
while total and total[-1] > 7:
    total.pop()
return a + b + 0 * sum(total)
"""


def test_zips_of_a_class(tmp_path):
    assignment = catalogue.load(sums.write_assignment(tmp_path / "sums"))
    (tmp_path / "class").mkdir()
    texts = {"1": sums.submission(add=LONG), "2": copied(sums.submission(add=LONG)), "3": "this is no program"}
    texts |= {str(i): sums.submission(add=f"return a {'- 0 ' * i}+ b") for i in range(4, 10)}
    for name, text in texts.items():
        sums.zipped(tmp_path / "class" / f"{name}.zip", {"sums.py": text})
    sums.zipped(tmp_path / "class" / "evil.zip", {"../sums.py": LONG})
    (group,) = similar.groups(assignment, find(tmp_path / "class", assignment.files))
    assert group.keys == ("1.zip", "2.zip")
    assert "Sums.add" in str(group)
    assert group.facts()["share"] == 1
