"""The walk-through of docs/teaching.md, done as a teacher does it: its files, its commands, and what they tell."""

import re
from pathlib import Path

import pytest

from taichi_tracer.apps.cli import main
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue

DOCUMENT = Path(__file__).parents[2] / "docs" / "teaching.md"
FILE = re.compile(r"^`(sphere/[^`]+)`:\n\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)
RIGHT = "1 of 1 parts are right: 10 of 10 points"


pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder in which the files of the document are, and everything that its commands write."""
    root = tmp_path_factory.mktemp("course")
    for name, text in FILE.findall(DOCUMENT.read_text(encoding="utf-8")):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    return root


@pytest.fixture
def there(place, monkeypatch):
    """The same, as the working folder."""
    monkeypatch.chdir(place)
    return place


def test_the_commands_tell_what_the_document_says(there, capfd):
    text = DOCUMENT.read_text(encoding="utf-8")
    commands = re.search(r"### 5\. Try it.*?```sh\n(.*?)```", text, re.DOTALL).group(1).strip().splitlines()
    told = []
    for command in commands:
        main(command.split()[1:])
        told.append(capfd.readouterr().out)
    assert RIGHT in told[1]
    assert RIGHT in text
    assert "not written Sphere.enter" in told[3]
    assert (
        (there / "handout" / "README.md").read_text(encoding="utf-8").startswith("# Where does a ray enter a sphere?")
    )


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("parts.py", "", "parts.py: the file has no PARTS"),
        ("parts.py", "def f(:\n", "parts.py:1: SyntaxError: invalid syntax$"),
        ("README.md", None, "README.md is missing, so this is no assignment"),
        ("mistakes.py", "MISTAKES = ()", "MISTAKES must be a dict"),
        ("mistakes.py", "MISTAKES = {'X.y': {'n': ('h', ('a', 'b'))}}", "no part"),
        ("solution/shapes.py", "class Other:\n    pass\n", "tests the class Sphere, which is in no file"),
        ("solution/shapes.py", "def f(:\n", "shapes.py:1: invalid syntax"),
    ],
)
def test_what_is_missing_is_told(place, tmp_path, file, text, message):
    import shutil

    shutil.copytree(place / "sphere", tmp_path / "broken")
    (tmp_path / "broken" / file).unlink()
    if text is not None:
        (tmp_path / "broken" / file).write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        catalogue.load(tmp_path / "broken")
