"""The documents say what is so: their commands parse, their pictures are there, their Python runs."""

import re
import shlex
import shutil
import zipfile
from pathlib import Path
from typing import NamedTuple

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
README, TOUR, PROGRAMS = (
    path.read_text(encoding="utf-8")
    for path in (DOCUMENTS[0], ROOT / "docs" / "tour.md", ROOT / "docs" / "programs.md")
)


HAND_IN = ROOT / "tests" / "course" / "handin"
CODE = re.compile(r"^(taichi-tracer|python3?|pip|import|from|tt\.)[ .\w]", re.MULTILINE)
FILE = re.compile(r"^`(sphere/[^`]+)`:\n\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


class Code(NamedTuple):
    """A block of code, which a reader copies from a page."""

    page: str
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


def code_of_the_pages():
    """Every block of Python and of the shell."""
    found = []
    for path in DOCUMENTS:
        text = path.read_text(encoding="utf-8")
        for block in re.finditer(r"^```(\w*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
            if block[1] in ("python", "sh"):
                found.append(Code(path.name, text[: block.start()].count("\n") + 1, block[1], block[2]))
    return found


# What stands in a block of Python, or in a line of the shell → why no test runs this block, or this line.
NOT_RUN = {
    "python3 -m venv": "makes the environment in which the tests run, and opens a window or runs them",
    "pip install": "installs packages from the network",
    "python -m benchmarks": "takes up to half an hour, and writes the results of this machine",
    "taichi-tracer view": "opens a window, or a page in a browser, until the user closes it",
    "ti.ui.Window": "opens a window",
    "tt.show(": "shows a picture in a notebook",
    "10.0.0.1": "asks other machines",
    "dask scheduler": "waits for other machines",
    "SLURMCluster": "asks the machines of SLURM",
    "openssl": "makes certificates of a lab: tests/cluster makes such ones, and uses them",
    "hardcases --full": "takes an hour",
    "hardcases --report": "takes 10 minutes: --quick is run",
    "of.film.ranges": "quotes a file",
    "= self.sample(scene": "quotes a file",
    "scene.visible_radiance(surface": "quotes a file",
    "return w_i, surface.weight": "quotes a file",
}


def why_not(text):
    """Why something is not run; None if it is."""
    return next((reason for part, reason in NOT_RUN.items() if part in text), None)


def runnable(code):
    """What a test runs of a block: the lines of the shell that need nobody, or the whole Python."""
    if code.language == "python":
        return "" if why_not(code.text) else code.text
    return "".join(line for line in code.text.splitlines(True) if not why_not(line))


RUN = [code for code in code_of_the_pages() if runnable(code)]


def files_of_the_reader(code, folder):
    """Put the files into a folder that a page tells the reader to write, or that only the reader has."""
    own = [other for other in code_of_the_pages() if other.page == code.page and other.line < code.line]
    if "my_parts.py" in code.text and "-o my_parts.py" not in code.text:
        text = [other.text for other in own if other.language == "python"][-1]
        (folder / "my_parts.py").write_text(text, encoding="utf-8")
    if "A1_codebase" in code.text:
        shutil.copytree(HAND_IN, folder / "A1_codebase" / "taichi_tracer")
    for name in re.findall(r"\d+\.zip", code.text) + ["submissions/260123456.zip"] * ("a1 submissions" in code.text):
        (folder / name).parent.mkdir(exist_ok=True)
        with zipfile.ZipFile(folder / name, "w") as archive:
            for path in HAND_IN.glob("*.py"):
                archive.write(path, path.name)
    if " sphere " in code.text and code.page == "teaching.md":
        page = (ROOT / "docs" / code.page).read_text(encoding="utf-8")
        for name, text in FILE.findall(page):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")
        shutil.copytree(folder / "sphere" / "solution", folder / "submissions" / "260123456")
    (folder / "docs" / "images").mkdir(parents=True)  # where the pages' own pictures are


def commands():
    """(command, the block of code that has it) of every command that can be run without other machines."""
    shell = [code for code in code_of_the_pages() if code.language == "sh"]
    lines = [(line, code) for code in shell for line in code.text.splitlines() if line.startswith("taichi-tracer ")]
    return [(line, code) for line, code in lines if "10.0.0.1" not in line]


def test_there_are_commands():
    assert len(commands()) >= 6


@pytest.mark.parametrize(("line", "code"), commands(), ids=str)
def test_commands_parse_and_name_what_exists(line, code, tmp_path):
    """A file of parts is the Python that stands before the command; a folder has files of the course."""
    args = make_parser().parse_args([as_value(word) for word in shlex.split(line, comments=True)[1:]])
    files_of_the_reader(code, tmp_path)
    files = [tmp_path / path for path in args.parts if path.endswith(".py")]
    for file in files:
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


def test_the_readme_shows_every_view_and_the_tour_names_every_scene():
    for name in A1Renderer.names():
        picture = np.asarray(Image.open(ROOT / "docs" / "images" / f"cornell_box_{name}.png").convert("RGB"))
        assert f"docs/images/cornell_box_{name}.png" in README
        assert picture.shape == (256, 256, 3)
        assert picture.max() > 100
    for name in scene_names():
        assert f"`{name}`" in TOUR


@pytest.mark.parametrize(("file", "word"), [("normal.png", "tall_box"), ("box.exr", "normal_x")])
def test_the_first_programs_run_and_prints_what_was_hit(file, word, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (text,) = [text for text in blocks(PROGRAMS, "python") if f'renderer.save("{file}"' in text]
    exec(compile(text, "programs.md", "exec"), {})
    assert word in capsys.readouterr().out
    assert (tmp_path / file).exists()


def test_the_programs_name_every_raw_array_with_its_channels():
    for aov in AOVS.values():
        (row,) = [line for line in PROGRAMS.splitlines() if line.startswith(f"| `{aov.name}` |")]
        assert row.endswith(f"| {', '.join(f'`{name}`' for name in aov.channels)} |")


def test_every_block_is_run_or_has_a_reason():
    """A reason that fits nothing is out of date; code without a language is none that anybody could run."""
    everything = code_of_the_pages()
    assert len(RUN) > 50
    assert [part for part in NOT_RUN if not any(part in code.text for code in everything)] == []
    for path in DOCUMENTS:
        for language, text in re.findall(r"^```(\w*)\n(.*?)^```$", path.read_text("utf-8"), re.DOTALL | re.MULTILINE):
            if language not in ("python", "sh"):
                assert not CODE.search(text), f"{path.name}: code without a language, or with another one: {text}"
