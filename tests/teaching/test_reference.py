"""What a class is compared with: answers that are kept between runs."""

import numpy as np
import pytest
from teaching import sums

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue, reference
from taichi_tracer.teaching.reference import Reference

PARTS = {"A.f": {"x": np.arange(3.0)}, "picture: a/b": {"y": np.ones((2, 2)), "z": np.array(1)}}


def test_answers_are_kept(tmp_path):
    path = tmp_path / "expected.npz"
    reference.write(path, PARTS)
    found = reference.read(path, PARTS)
    assert {part: list(arrays) for part, arrays in found.items()} == {"A.f": ["x"], "picture: a/b": ["y", "z"]}
    np.testing.assert_array_equal(found["A.f"]["x"], PARTS["A.f"]["x"])


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", None])
def test_damaged_answers_are_computed_again(content, tmp_path):
    path = tmp_path / "expected.npz"
    if content is not None:
        path.write_bytes(content)
    assert reference.read(path, PARTS) is None
    reference.write(path, {"A.f": PARTS["A.f"]})
    assert reference.read(path, PARTS) is None  # a part is missing


def test_another_solution_has_other_answers(tmp_path):
    first = reference.fingerprint(catalogue.load(sums.write_assignment(tmp_path / "a")))
    folder = sums.write_assignment(tmp_path / "b")
    (folder / "solution" / "sums.py").write_text(sums.SOLUTION.replace("a * b", "b * a"))
    assert reference.fingerprint(catalogue.load(folder)) != first


@pytest.mark.exhaustive
@pytest.mark.parametrize(("body", "told"), [("raise ValueError('x')", "crashed: .*ValueError"), ("exit(1)", "crashed")])
def test_a_solution_that_does_not_run_is_told(body, told, tmp_path, monkeypatch):
    monkeypatch.setenv("TAICHI_TRACER_CACHE", str(tmp_path / "cache"))
    folder = sums.write_assignment(tmp_path / "sums")
    (folder / "solution" / "sums.py").write_text(sums.SOLUTION.replace("return a + b", body))
    with Reference(catalogue.load(folder), 1) as one, pytest.raises(InputError, match=told):
        assert one.expected
