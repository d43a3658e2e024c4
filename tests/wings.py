"""Copies of the package without some of its folders or files, and programs that use such a copy.

Example: ``run(copy_without(tmp_path, "fast"), program, "bvh")`` runs a Python program, with one argument, in a process
that finds a package without ``fast``.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import taichi_tracer

PACKAGE = Path(taichi_tracer.__file__).parent
SCENES = "scene_data_dir"  # the folder of the shipped scenes, beside the package


def copy_without(folder: Path, *wings: str) -> Path:
    """Copy the package and the shipped scenes into an empty folder. Returns this folder.

    Args:
        folder: where the copy is made.
        wings: folders or files of the package that the copy lacks, such as "fast" or "system/taichi_17"; none for a
            copy of everything.
    """
    shutil.copytree(PACKAGE, folder / PACKAGE.name, ignore=shutil.ignore_patterns("__pycache__"))
    for wing in wings:
        path = folder / PACKAGE.name / wing
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()
    (folder / SCENES).symlink_to(PACKAGE.parent / SCENES, target_is_directory=True)
    return folder


def run(folder: Path, program: str, *arguments: str, **variables: str) -> subprocess.CompletedProcess:
    """Run a Python program in a process of its own, which imports the package from a folder.

    Args:
        folder: what ``copy_without`` returned.
        program: the text of the program. It is written into a file, because Taichi reads the source of kernels.
        arguments: ``sys.argv[1:]`` of the program.
        variables: further environment variables.

    Returns:
        the process that has ended, with its ``returncode``, and ``stdout`` and ``stderr`` as text.
    """
    file = folder / "program_of_a_test.py"
    file.write_text(program)
    environment = os.environ | {"PYTHONPATH": str(folder)} | variables
    command = [sys.executable, str(file), *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)


def printed(folder: Path, program: str, *arguments: str, **variables: str) -> str:
    """What a program prints; see ``run``. The program must succeed."""
    done = run(folder, program, *arguments, **variables)
    assert done.returncode == 0, done.stderr
    return done.stdout
