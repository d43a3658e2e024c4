"""The wheel: complete, without tests, and enough to render with from another folder."""

import os
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

import taichi_tracer as tt

pytest.importorskip("build", reason="building a wheel needs the extra [test]")
pytest.importorskip("hatchling", reason="a wheel is built without downloads, with the hatchling that is installed")

ROOT = Path(__file__).parent.parent
WHICH_FILES = "import taichi_tracer as tt; print(tt.__file__); print(tt.load_scene_data('cube').source)"


def run(*words: object, **options) -> str:
    """What a Python command prints; it must succeed."""
    command = [sys.executable, *map(str, words)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, **options)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of this checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    run("-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT)
    (path,) = folder.iterdir()
    return path


@pytest.fixture(scope="module")
def files(wheel):
    """Path → content of every file in the wheel."""
    with ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """A folder that has nothing but the installed wheel."""
    folder = tmp_path_factory.mktemp("installed")
    run("-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", folder, wheel)
    return folder


@pytest.fixture
def elsewhere(installed, tmp_path):
    """Options of ``run`` for a process that starts in an empty folder and finds the installed package first."""
    return {"cwd": tmp_path, "env": os.environ | {"PYTHONPATH": str(installed)}}


@pytest.mark.parametrize("folder", ["taichi_tracer", "scene_data_dir"])
def test_the_wheel_has_every_file_of(folder, files):
    inside = {"taichi_tracer": "taichi_tracer", "scene_data_dir": "taichi_tracer/scene_data_dir"}[folder]
    here = [p for p in (ROOT / folder).rglob("[!.]*") if p.is_file() and "__pycache__" not in p.parts]
    assert len(here) > 5
    for path in here:
        assert files[f"{inside}/{path.relative_to(ROOT / folder).as_posix()}"] == path.read_bytes()


def test_the_wheel_knows_its_version_and_what_it_needs(files):
    metadata = files[f"taichi_tracer-{tt.__version__}.dist-info/METADATA"].decode().splitlines()
    assert f"Version: {tt.__version__}" in metadata
    needed = {line.removeprefix("Requires-Dist: ").split(">")[0].split("<")[0] for line in metadata if is_core(line)}
    assert {name.lower() for name in needed} == {
        "taichi",
        "numpy",
        "trimesh",
        "pillow",
        "tqdm",
        "matplotlib",
        "websockets",
        "flip-evaluator",
        "mapbox-earcut",
    }


def is_core(line: str) -> bool:
    """Whether a line of the metadata names a package that every user needs."""
    return line.startswith("Requires-Dist: ") and "extra ==" not in line


def test_the_installed_package_uses_its_own_files(installed, elsewhere):
    package, scene = run("-c", WHICH_FILES, **elsewhere).splitlines()
    assert Path(package) == installed / "taichi_tracer" / "__init__.py"
    assert (installed / "taichi_tracer" / "scene_data_dir") in Path(scene).parents


def test_the_installed_package_answers_from_another_folder(elsewhere):
    told = run("-m", "taichi_tracer", "info", "cornell_box", **elsewhere)
    assert "triangles       " in told
    assert f"{tt.load_scene_data('cornell_box').num_triangles:,}\n" in told


def test_the_installed_package_renders(elsewhere):
    run("-m", "taichi_tracer", "render", "cube", "--view", "normal", "--size", "16x16", "-o", "a.png", **elsewhere)
    assert tt.read_image(elsewhere["cwd"] / "a.png").std() > 0.05


@pytest.mark.skipif(sys.platform == "win32", reason="the command is a program there, not a script")
def test_the_installed_command_starts(installed, elsewhere):
    told = run(installed / "bin" / "taichi-tracer", "--version", **elsewhere)
    assert told.strip() == f"taichi-tracer {tt.__version__}"
