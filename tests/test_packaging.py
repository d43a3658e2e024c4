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


def test_the_installed_package_renders(elsewhere):
    run("-m", "taichi_tracer", "render", "cube", "--view", "normal", "--size", "16x16", "-o", "a.png", **elsewhere)
    assert tt.read_image(elsewhere["cwd"] / "a.png").std() > 0.05


@pytest.mark.skipif(sys.platform == "win32", reason="the command is a program there, not a script")
def test_the_installed_command_starts(installed, elsewhere):
    told = run(installed / "bin" / "taichi-tracer", "--version", **elsewhere)
    assert told.strip() == f"taichi-tracer {tt.__version__}"
