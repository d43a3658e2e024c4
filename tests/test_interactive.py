"""interactive/: thin programs that run from any folder, with a window or without one."""

from pathlib import Path

import pytest

PROGRAMS = sorted((Path(__file__).parents[1] / "interactive").glob("*.py"))


def test_there_are_programs():
    assert [p.name for p in PROGRAMS] == ["A1.py", "A2.py", "A3.py", "A4.py"]


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda p: p.name)
def test_programs_stay_thin(program):
    assert len(program.read_text(encoding="utf-8").splitlines()) < 30
