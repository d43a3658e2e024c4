"""Pages of the class and of students: everything is in them, and what a stranger chose is text."""

import re

import numpy as np
import pytest

from taichi_tracer.teaching.base import PartResult
from taichi_tracer.teaching.grading import class_page
from taichi_tracer.teaching.grading.grade import GradingSettings, Mark

EVIL = "<script>document.title='hacked'</script>"
FOUND = {"names": ["pixel corner"], "share": 1.0, "text": "all agree", "hint": "which point?", "topic": "rays"}
OF_F = {"name": "A.f", "topic": "rays", "points": 4.0}
WRONG = PartResult("wrong", 0.5, "2 of 4", {"input": {"x": [1]}, "yours": {"y": EVIL}}, findings=(FOUND,), **OF_F)
RIGHT = PartResult("right", 1.0, seconds=1.0, **OF_F)
CRASHED = PartResult("crashed", 0.0, EVIL, **OF_F)
IMAGE = np.linspace(0, 1, 48 * 48 * 3).reshape(48, 48, 3)
PICTURES = {"yours": IMAGE, "right": IMAGE[::-1], "difference": abs(IMAGE - IMAGE[::-1])}
PICTURE = PartResult("wrong", 0.2, "many pixels", {}, PICTURES, name="picture: x", topic="all", points=1.0)
MARKS = (
    Mark("123456781.zip", "123456781", (RIGHT, PICTURE)),
    Mark("123456782.zip", "123456782", (WRONG, PICTURE), "", ("a note",)),
    Mark("123456783.zip", "123456783", (WRONG, PICTURE), printed=EVIL),
    Mark(f"{EVIL}.zip", EVIL, (CRASHED, PICTURE), refused=EVIL),
    Mark("a b.zip", "a b", (RIGHT, PICTURE)),
    Mark("a_b.zip", "a_b", (RIGHT, PICTURE)),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The pages of a class."""
    place = tmp_path_factory.mktemp("pages")
    assignment = type("Assignment", (), {"title": "A & B"})
    class_page.write(place, assignment, MARKS, GradingSettings("bwrap"))
    return place


def test_the_page_of_the_class_has_everything(folder):
    text = (folder / "index.html").read_text()
    assert EVIL not in text
    assert "src=" not in text  # nothing is loaded
    links = re.findall(r"<a href=[\"']([^\"']*)", text)
    assert len(links) >= len(MARKS)
    for link in links:
        assert (folder / link).is_file()
        student = (folder / link).read_text()
        assert EVIL not in student
        assert {source[:5] for source in re.findall(r"\bsrc=[\"']([^\"']*)", student)} == {"data:"}
    rows = re.findall(r">pixel corner</td><td data-head='students'>(\d+)</td>", text)
    assert rows == ["2"]
    for word in (
        "6 submissions; mean ",
        "Seed of the inputs: 1",
        "bwrap",
        "A &amp; B",
    ):
        assert word in text
