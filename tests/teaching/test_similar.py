"""Submissions that are alike: copies under other names are found, independent solutions are not."""

import ast
from pathlib import Path

import pytest
from teaching.variants import FOLDER

from taichi_tracer.teaching import catalogue, similar
from taichi_tracer.teaching.cutting import solved, stub_of

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
