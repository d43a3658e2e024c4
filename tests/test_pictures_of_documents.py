"""docs/make.py makes the pictures that the documents show: all of them, and as they are kept."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support import start

ROOT = Path(__file__).parents[1]
SCRIPT = ROOT / "docs" / "make.py"
IMAGES = ROOT / "docs" / "images"
QUICK = ("cornell_box", "rt3/four_corners", "rt3/three_spheres")  # the scenes of the pictures that take no samples
FEW = 0.02  # of the pixels, which may differ where sin, exp and the like are rounded otherwise

spec = importlib.util.spec_from_file_location("make", SCRIPT)
make = importlib.util.module_from_spec(spec)
spec.loader.exec_module(make)
COMMANDS = make.commands()


def shown():
    """The names of the pictures that the documents show."""
    texts = [path.read_text(encoding="utf-8") for path in make.DOCUMENTS]
    return {Path(name).name for text in texts for name in re.findall(r"\]\(([^)]*images/[^)]+)\)", text)}


def check_same(paths):
    """The pictures are those of docs/images, but for a few pixels."""
    start("f32")
    different = {}
    for path in paths:
        differ = make.share_that_differs(path, IMAGES / path.name)
        if differ > FEW:
            different[path.name] = differ
    assert different == {}, "python -m docs.make makes them again"


def test_every_picture_is_shown_and_every_picture_that_is_shown_is_there():
    assert {path.name for path in IMAGES.iterdir()} == shown()


def test_every_picture_is_made_by_a_command_that_a_document_prints_or_by_the_script():
    others = {*make.OTHERS, *make.MEASURED}
    files = {words[-1].rsplit("/", 1)[1] for words in COMMANDS} - {""}
    programs = {name for names in make.programs().values() for name in names}
    folders = {make.stem(words) for words in COMMANDS if words[-1].endswith("/")}
    left = {name for name in shown() - others - files - programs if not name.startswith(tuple(folders))}
    assert left == set()
    assert files | others | programs <= shown()


@pytest.mark.parametrize("document", make.DOCUMENTS, ids=lambda path: path.name)
def test_a_picture_has_its_command_in_its_section(document):
    for section in re.split(r"^#+ ", document.read_text(encoding="utf-8"), flags=re.MULTILINE):
        if re.search(r"!\[[^\]]*\]\([^)]*images/", section):
            assert re.search(r"^```(sh|python)$", section, re.MULTILINE), section.splitlines()[0]


def size(path):
    """(width, height) of a picture."""
    with Image.open(path) as image:
        return image.size


def test_a_picture_that_is_not_the_one_that_is_kept_is_found(tmp_path):
    pixels = np.array(Image.open(IMAGES / "cornell_box_hit.png"))
    pixels[::2] ^= 1
    Image.fromarray(pixels).save(tmp_path / "cornell_box_hit.png")
    with pytest.raises(AssertionError, match="cornell_box_hit"):
        check_same([tmp_path / "cornell_box_hit.png"])
