"""A small assignment in plain Python, and submissions of it: what the tests of the grader run."""

import textwrap
import zipfile
from pathlib import Path

PARTS = """
import numpy as np

from taichi_tracer.teaching.base import Part
from taichi_tracer.teaching.base import Numbers


def numbers(rng):
    return {"a": rng.uniform(-1, 1, 20), "b": rng.uniform(-1, 1, 20)}


def run(name):
    return lambda cls, inputs: {"value": np.asarray(getattr(cls(), name)(inputs["a"], inputs["b"]))}


PARTS = tuple(
    Part(f"Sums.{name}", points, "sums", "Sums", numbers, run(name), Numbers(1e-6, called="sums"))
    for name, points in (("add", 2), ("subtract", 3), ("multiply", 5))
)
"""
SOLUTION = '''
"""Sums of two arrays."""


class Sums:
    """Sums of two arrays."""

    def add(self, a, b):
        """a + b"""
        ### BEGIN SOLUTION
        return a + b
        ### END SOLUTION

    def subtract(self, a, b):
        """a - b"""
        ### BEGIN SOLUTION
        return a - b
        ### END SOLUTION

    def multiply(self, a, b):
        """a b"""
        ### BEGIN SOLUTION
        return a * b
        ### END SOLUTION
'''
POINTS = 10
RIGHT = {"Sums.add": 2.0, "Sums.subtract": 3.0, "Sums.multiply": 5.0}


def write_assignment(folder: Path) -> Path:
    """Write the assignment; returns its folder."""
    (folder / "solution").mkdir(parents=True)
    (folder / "README.md").write_text("# Sums\n")
    (folder / "parts.py").write_text(PARTS)
    (folder / "solution" / "sums.py").write_text(SOLUTION)
    return folder


def submission(top: str = "", add: str = "return a + b", subtract: str = "return a - b") -> str:
    """The text of a sums.py.

    Args:
        top: code that runs when the file is loaded. add, subtract: the bodies of these methods.
    """
    methods = {"add": add, "subtract": subtract, "multiply": "return a * b"}
    text = f"{textwrap.dedent(top)}\n\nclass Sums:\n"
    for name, body in methods.items():
        text += f"    def {name}(self, a, b):\n" + textwrap.indent(textwrap.dedent(body).strip(), " " * 8) + "\n\n"
    return text


def zipped(path: Path, files: dict[str, str | bytes]) -> Path:
    """A zip file with these files."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path
