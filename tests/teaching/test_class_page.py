"""Pages of the class and of students: everything is in them, and what a stranger chose is text."""

import re
from html.parser import HTMLParser

import numpy as np
import pytest

from taichi_tracer.teaching import class_page
from taichi_tracer.teaching.base import PartResult
from taichi_tracer.teaching.grade import GradingSettings
from taichi_tracer.teaching.isolate import WallLevel
from taichi_tracer.teaching.marks import Mark
from taichi_tracer.teaching.submissions import Submission

EVIL = "<script>document.title='hacked'</script>"
FOUND = {"names": ["pixel corner"], "share": 1.0, "text": "all agree", "hint": "which point?", "topic": "rays"}
OF_F = {"name": "A.f", "topic": "rays", "points": 4.0}
WRONG = PartResult("wrong", 0.5, "2 of 4", {"input": {"x": [1]}, "yours": {"y": EVIL}}, findings=(FOUND,), **OF_F)
RIGHT = PartResult("right", 1.0, seconds=1.0, **OF_F)
CRASHED = PartResult("crashed", 0.0, EVIL, **OF_F)
PICTURE = PartResult("wrong", 0.2, "many pixels", name="picture: x", topic="all", points=1.0)
MARKS = (
    Mark("123456781.zip", "123456781", (RIGHT, PICTURE), level="bwrap"),
    Mark("123456782.zip", "123456782", (WRONG, PICTURE), "", ("a note",), ("x imports 'os'",)),
    Mark("123456783.zip", "123456783", (WRONG, PICTURE), printed=EVIL),
    Mark(f"{EVIL}.zip", EVIL, (CRASHED, PICTURE), refused=EVIL),
    Mark("a b.zip", "a b", (RIGHT, PICTURE)),
    Mark("a_b.zip", "a_b", (RIGHT, PICTURE)),
)


class Tags(HTMLParser):
    """What a page contains: tags that are opened and closed in order, links, and whether anything is loaded."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open, self.links, self.loaded, self.images = [], [], [], 0
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        if tag == "a":
            self.links.append(found["href"])
        if "src" in found and not found["src"].startswith("data:"):
            self.loaded.append(found["src"])
        self.images += tag == "img"
        if tag not in ("meta", "img", "rect", "line", "br"):
            self.open.append(tag)
        assert tag not in (
            "link",
            "iframe",
        )  # a script stands in the page itself: those with a source are in ``loaded``

    def handle_startendtag(self, tag, attributes):
        assert tag in ("rect", "line", "img")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The pages of a class."""
    place = tmp_path_factory.mktemp("pages")
    found = [Submission(place / mark.key, mark.key, mark.student) for mark in MARKS]
    picture = np.linspace(0, 1, 48 * 48 * 3).reshape(48, 48, 3)
    pictures = {"picture: x": {"yours": picture, "right": picture[::-1], "difference": abs(picture - picture[::-1])}}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(class_page, "pictures_of", lambda *args: pictures)
        assignment = type("Assignment", (), {"title": "A & B"})
        class_page.write(place, assignment, found, MARKS, GradingSettings(WallLevel("bwrap")))
    return place


def test_the_page_of_the_class_has_everything(folder):
    text = (folder / "index.html").read_text()
    tags = Tags(text)
    assert tags.loaded == []
    assert tags.images == len(MARKS) + 1
    for link in tags.links:
        assert (folder / link).is_file()
    rows = re.findall(r">pixel corner</td><td data-head='students'>(\d+)</td>", text)
    assert rows == ["2"]
    for word in (
        "6 submissions; mean ",
        "Seed of the inputs: 1",
        "bwrap",
        "A &amp; B",
    ):
        assert word in text


# ── in a real browser ──
