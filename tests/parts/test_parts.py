"""The seven parts of this folder are examples for students: short, of public names, and right."""

import re
import shutil
from pathlib import Path

import pytest

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.system.parts import PARTS

FILES = sorted(path for path in Path(__file__).parent.glob("*.py") if path != Path(__file__))
MOST_LINES = 60
QUICK = "fisheye_camera", "point_light"  # the others compile a picture

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize(
    "file", [pytest.param(one, marks=[pytest.mark.slow] * (one.stem not in QUICK), id=one.stem) for one in FILES]
)
def test_a_part_is_short_and_right(file, tmp_path, capsys):
    own = Path(shutil.copy(file, tmp_path))  # a page is written beside it
    text = file.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= MOST_LINES
    assert set(re.findall(r"\btt\.(\w+)", text)) <= set(tt.__all__)
    try:
        assert main(["check-part", str(own)]) == 0, capsys.readouterr().out
    finally:
        for part in PARTS.registered_by(own):
            PARTS.remove(part)
