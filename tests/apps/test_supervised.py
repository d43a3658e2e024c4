"""A check whose parts never answer, or end their process: the other parts are checked, and the page is written."""

import os

import pytest
from teaching import sums

from taichi_tracer.apps.cli import main

pytestmark = pytest.mark.skipif(os.name != "posix", reason="elsewhere, a check runs in the process that is asked")


@pytest.fixture
def assignment(tmp_path):
    return sums.write_assignment(tmp_path / "sums")


def words(tmp_path, assignment, **bodies):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "sums.py").write_text(sums.submission(**bodies))
    return ["check", str(tmp_path / "mine"), "--assignment", str(assignment)]


def test_a_part_that_ends_the_process_costs_itself_alone(tmp_path, assignment, capfd):
    asked = words(tmp_path, assignment, add="return __import__('os')._exit(3)", subtract="return a")
    assert main(asked) == 1
    out = capfd.readouterr().out
    assert out.count("# Sums") <= 1
    assert "sums.py:4: the process ended (exit code 3)" in out
    assert "1 of 3 parts are right: 5" in out
    page = (tmp_path / "mine" / "check.html").read_text()
    assert [name in page for name in ("Sums.add", "Sums.subtract", "Sums.multiply")] == [True] * 3
