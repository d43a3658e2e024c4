"""The documents say what is so: their commands parse, their pictures are there, their Python runs."""

import re
import shlex
import shutil
import zipfile
from pathlib import Path
from typing import NamedTuple

import pytest

from taichi_tracer.apps.cli import main, make_parser
from taichi_tracer.apps.pictures import find_views
from taichi_tracer.scene_data_loader import find_scene
from taichi_tracer.system.parts import PARTS, load_parts

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
PROGRAMS = (ROOT / "docs" / "programs.md").read_text(encoding="utf-8")
HAND_IN = ROOT / "tests" / "course" / "handin"
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


def commands():
    """(command, the block of code that has it) of every command that can be run without other machines."""
    shell = [code for code in code_of_the_pages() if code.language == "sh"]
    lines = [(line, code) for code in shell for line in code.text.splitlines() if line.startswith("taichi-tracer ")]
    return [(line, code) for line, code in lines if "10.0.0.1" not in line]


@pytest.mark.parametrize(("line", "code"), commands(), ids=str)
def test_commands_parse_and_name_what_exists(line, code, tmp_path):
    """A file of parts is the Python that stands before the command; a folder has files of the course."""
    args = make_parser().parse_args(shlex.split(line, comments=True)[1:])
    files_of_the_reader(code, tmp_path)
    files = [tmp_path / path for path in args.parts if path.endswith(".py") and "--parts" in line]
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


@pytest.mark.parametrize(("file", "word"), [("normal.png", "tall_box"), ("box.exr", "normal_x")])
def test_the_first_programs_run_and_prints_what_was_hit(file, word, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (text,) = [text for text in blocks(PROGRAMS, "python") if f'renderer.save("{file}"' in text]
    exec(compile(text, "programs.md", "exec"), {})
    assert word in capsys.readouterr().out
    assert (tmp_path / file).exists()


def test_the_explained_pixel_is_what_its_command_prints(capsys):
    """Its last three lines: the mean, its standard error and the work."""
    page = (ROOT / "docs" / "explain.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"^```\n(pixel in column.*?)\n```$", page, re.DOTALL | re.MULTILINE)
    command = blocks(page, "sh")[0].splitlines()[0]
    assert main([*shlex.split(command)[1:], "--arch", "cpu"]) == 0
    printed = capsys.readouterr().out.strip()
    one, other = (
        [float(x) for x in re.findall(r"[\d.]+", "\n".join(text.splitlines()[-3:]))] for text in (shown, printed)
    )
    assert one == pytest.approx(other, rel=1e-3)
