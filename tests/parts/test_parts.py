"""The seven parts of this folder: loaded by --parts, each shows a picture that is known in closed form.

They are examples for students: at most 60 lines, and nothing but public names.
"""

import ast
from pathlib import Path

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.contracts import cameras, lights, samplers
from taichi_tracer.system import runtime
from taichi_tracer.system.registry import PARTS, load_parts

HERE = Path(__file__).parent
FILES = {
    "ggx": "ggx_brdf.py",
    "point": "point_light.py",
    "two_bounce": "two_bounce.py",
    "stratified": "stratified_sampler.py",
    "fisheye": "fisheye_camera.py",
    "heat_map": "heat_map_view.py",
    "grid": "grid_intersector.py",
}
MOST_LINES = 60


@pytest.fixture(autouse=True)
def _taichi_and_registry(tmp_path, monkeypatch):
    """Taichi as the command line starts it on the CPU; what a test registers is forgotten at its end."""
    if runtime.current() != runtime.Settings("cpu", "f32", False):
        runtime.init("cpu", force=True)
    monkeypatch.chdir(tmp_path)
    yield
    for file in FILES.values():
        for part in PARTS.registered_by(HERE / file):
            PARTS.remove(part)


def part(name):
    """The part of this name, loaded from its file."""
    load_parts(str(HERE / FILES[name]))
    (loaded,) = PARTS.registered_by(HERE / FILES[name])
    return loaded


def rendered(name, scene, *words):
    """(h, w, 3) float64, top row first: what the command line renders with the file of a part, 24 × 24 pixels."""
    words = [scene, "--parts", str(HERE / FILES[name]), "--size", "24", *map(str, words), "-o", "picture.npy"]
    assert main(["render", *words]) == 0
    return np.load("picture.npy").astype(np.float64)


def test_parts_are_short_and_use_public_names():
    for name in FILES.values():
        text = (HERE / name).read_text(encoding="utf-8")
        assert len(text.splitlines()) <= MOST_LINES, name
        tree = ast.parse(text)
        imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
        assert imported <= {"taichi", "taichi.math", "taichi_tracer", "numpy"}, name
        assert not any(isinstance(node, ast.ImportFrom) for node in ast.walk(tree)), name
        used = {
            node.attr
            for node in ast.walk(tree)
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "tt"
        }
        assert used <= set(tt.__all__), name
        for node in ast.walk(tree):
            if (
                isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
                and getattr(node, "name", "") != "__init__"
            ):
                assert ast.get_docstring(node), (name, node)


# ── a light ──


def test_point_light_keeps_the_contract():
    lights.check_light(part("point"))


def test_every_stratum_has_a_sample():
    """Of samples 0 … 15 and 16 … 31 of some pixels, one in each of 4 × 4 squares, in every dimension."""
    sampler = samplers.bound(part("stratified"))
    for x, y in ((0, 0), (5, 9), (100, 3)):
        found = samplers.numbers(sampler, samplers.keys_of_samples(x, y, 32)).astype(np.float64)
        for block in (found[:16], found[16:]):
            squares = np.floor(block * 4) @ [4, 1]
            assert (np.sort(squares, axis=0) == np.arange(16)[:, None]).all()


# ── a camera ──


def test_fisheye_keeps_the_contract():
    cameras.check_camera(part("fisheye"))


# ── an intersector ──
