"""What a class is compared with: answers that are kept between runs."""

import numpy as np
from teaching import sums

from taichi_tracer.teaching import catalogue, kept, reference


def test_answers_without_those_of_a_part_are_computed_again(tmp_path):
    path, answers = tmp_path / "expected.npz", {"x": np.zeros(3)}
    assert reference.read(path, ["A.f"]) is None
    kept.keep_arrays(path, kept.joined({"A.f": answers}))
    assert list(reference.read(path, ["A.f"])) == ["A.f"]
    assert reference.read(path, ["A.f", "A.g"]) is None


def test_another_solution_has_other_answers(tmp_path):
    first = reference.fingerprint(catalogue.load(sums.write_assignment(tmp_path / "a")))
    folder = sums.write_assignment(tmp_path / "b")
    (folder / "solution" / "sums.py").write_text(sums.SOLUTION.replace("a * b", "b * a"))
    assert reference.fingerprint(catalogue.load(folder)) != first
