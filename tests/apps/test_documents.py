"""The documents say what is so: their commands parse, their pictures are there, their Python runs."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import taichi_tracer as tt
from taichi_tracer.apps.cli import make_parser
from taichi_tracer.apps.names import find_views
from taichi_tracer.apps.words import as_value
from taichi_tracer.picture.aovs import AOVS
from taichi_tracer.renderer import A1Renderer
from taichi_tracer.scene_data_loader import find_scene, scene_names
from taichi_tracer.system.registry import HOMES, PARTS, load_parts
from taichi_tracer.system.seams import gives_of, parameters

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
DESIGN = (ROOT / "docs" / "design.md").read_text(encoding="utf-8")
README = DOCUMENTS[0].read_text(encoding="utf-8")


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def commands():
    """(command, the Python that stands before it in the document) of every command."""
    found = []
    for path in DOCUMENTS:
        text = path.read_text(encoding="utf-8")
        for block in re.finditer(r"```sh\n(.*?)```", text, re.DOTALL):
            python = blocks(text[: block.start()], "python")
            lines = [line for line in block[1].splitlines() if line.startswith("taichi-tracer ")]
            found += [(line, python[-1] if python else "") for line in lines]
    return found


def test_there_are_commands():
    assert len(commands()) >= 6


@pytest.mark.parametrize(("line", "python"), commands(), ids=lambda value: value if "\n" not in value else "")
def test_commands_parse_and_name_what_exists(line, python, tmp_path):
    """A file of parts is the Python that stands before the command; a folder has files of the course."""
    args = make_parser().parse_args([as_value(word) for word in shlex.split(line)[1:]])
    files = [tmp_path / path for path in args.parts if path.endswith(".py")]
    for file in files:
        file.write_text(python, encoding="utf-8")
        load_parts(str(file))
    try:
        if "scene" in args:
            assert find_scene(args.scene).exists()
        if getattr(args, "view", None) is not None:
            assert find_views(args.view)
    finally:
        for part in [part for file in files for part in PARTS.registered_by(file)]:
            PARTS.remove(part)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_links_lead_somewhere(document):
    targets = re.findall(r"\]\(([^)#]+)", document.read_text(encoding="utf-8"))
    missing = [t for t in targets if not t.startswith("https://") and not (document.parent / t).exists()]
    assert missing == []


EXAMPLES = ("my_parts.py", "solution/shapes.py", "sphere/", "DIR/index.html", "pixel.html", "difference.html")
NAME_OF_A_FILE = re.compile(r"(?<![\w./-])((?:[\w-]+/)*[\w-]+\.(?:py|js|css|html))(?!\w)")


@pytest.mark.parametrize("document", [*DOCUMENTS, ROOT / "benchmarks" / "RESULTS.md"], ids=lambda p: p.name)
def test_every_file_that_is_named_exists(document):
    """Somewhere in the project; a folder may be left out."""
    there = [p.relative_to(ROOT).as_posix() for p in ROOT.rglob("*") if p.is_file() and ".venv" not in p.parts]
    named = {name for name in NAME_OF_A_FILE.findall(document.read_text("utf-8")) if not name.startswith(EXAMPLES)}
    assert [name for name in sorted(named) if not any(f"/{path}".endswith(f"/{name}") for path in there)] == []


def test_code_that_a_document_quotes_is_in_the_file_that_it_names():
    """A block of Python after a sentence that ends with a file in brackets: each of its lines is one of this file."""
    quoted = re.findall(r"\(`((?:[\w-]+/)*[\w-]+\.py)`\)[^\n]*:\n\n```python\n(.*?)```", DESIGN, re.DOTALL)
    assert len(quoted) >= 2
    for file, block in quoted:
        lines = {line.strip() for line in (ROOT / "taichi_tracer" / file).read_text("utf-8").splitlines()}
        assert [line for line in block.splitlines() if line.strip() not in lines] == [], file


ROW = re.compile(r"^\| `(\w+)\.(\w+)\(([\w, ]*)\)` \|.*\| (.*) \|$", re.MULTILINE)


def test_the_table_of_methods_is_that_of_the_classes():
    rows = ROW.findall(DESIGN)
    assert len(rows) > 15
    for owner, name, arguments, gives in rows:
        cls = getattr(tt, owner)
        assert parameters(getattr(cls, name)) == arguments.split(", "), f"{owner}.{name}"
        for kind in gives_of(cls).get(name, "").split():
            assert kind in gives, f"{owner}.{name}"


def test_the_table_has_every_kind_of_part():
    kinds = {getattr(tt, owner).kind for owner, *_ in ROW.findall(DESIGN)}
    assert kinds == set(HOMES) - {"renderer", "environment"}  # of which nobody writes a method that is called


def test_the_readme_shows_every_view_and_names_every_scene():
    for name in A1Renderer.names():
        picture = np.asarray(Image.open(ROOT / "docs" / "images" / f"cornell_box_{name}.png").convert("RGB"))
        assert f"docs/images/cornell_box_{name}.png" in README
        assert picture.shape == (256, 256, 3)
        assert picture.max() > 100
    for name in scene_names():
        assert f"`{name}`" in README


def test_the_readmes_python_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    for code in blocks(README, "python"):  # each goes on where the one before it ended
        exec(compile(code, "README.md", "exec"), names)
    out = capsys.readouterr().out
    assert "tall_box" in out
    assert "normal_x" in out
    assert (tmp_path / "normal.png").exists()
    assert (tmp_path / "box.exr").exists()


def test_the_readme_names_every_raw_array_with_its_channels():
    for aov in AOVS.values():
        (row,) = [line for line in README.splitlines() if line.startswith(f"| `{aov.name}` |")]
        assert row.endswith(f"| {', '.join(f'`{name}`' for name in aov.channels)} |")


def test_files_that_the_design_names_exist():
    tree = blocks((ROOT / "docs" / "design.md").read_text(encoding="utf-8"), "")[0]
    names = re.findall(r"^ *([a-z_]+\.py|[a-z_]+/)(?= |\n)", tree, re.MULTILINE)
    assert len(names) > 20
    for name in names:
        assert (ROOT / name).exists() or (ROOT / "taichi_tracer" / name).exists(), name


@pytest.mark.long
def test_the_radiance_that_the_page_of_paths_prints_for_the_white_room_is_the_exact_one(capsys):
    """The Python that saves pictures is run by tests/test_pictures_of_documents.py."""
    page = (ROOT / "docs" / "paths.md").read_text(encoding="utf-8")
    (code,) = [block for block in blocks(page, "python") if "white_room" in block]
    exec(compile(code, "paths.md", "exec"), {"tt": tt})
    rows = [[float(word.rstrip(",")) for word in line.split()[3::2]] for line in capsys.readouterr().out.splitlines()]
    assert len(rows) == 4
    for low, high, exact in rows:
        assert low == pytest.approx(exact, abs=2e-6)
        assert high == pytest.approx(exact, abs=2e-6)
