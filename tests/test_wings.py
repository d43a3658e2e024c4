"""Each wing can be taken off: the rest renders and answers rays with the same bits, and says in a line what it lacks.

Every test copies the package, removes one folder, and runs a program there.
"""

import json
from functools import cache
from pathlib import Path

import pytest
from support import long_except
from wings import copy_without, printed

from taichi_tracer.system.wings import WINGS

PROGRAM = """
import hashlib, json, sys, warnings
import numpy as np
import taichi_tracer as tt
from taichi_tracer import *
from taichi_tracer.system.registry import PARTS

def digest(array):
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()

warnings.simplefilter("ignore")
tt.init("cpu", threads=1)
pictures, missing = json.loads(sys.argv[1]), sys.argv[2]
scene = tt.load_scene_data("cornell_box", environment="studio")
rng = np.random.default_rng(1)
rays = rng.uniform(-1, 1, (64, 3)) + [0, 1, 0], rng.normal(size=(64, 3))
found = {name: digest(values) for name, values in scene.intersect(*rays).to_dict().items()}
found["occluded"] = digest(scene.occluded(*rays))
for renderer_class in PARTS.all("renderer"):
    for name in renderer_class.names():
        picture = f"{renderer_class.name}: {name}"
        if pictures is None or picture in pictures:
            found[picture] = digest(renderer_class(scene, 8, 8).use(name).render(2).image())
said = ""
try:
    said = str(eval(missing))
except (tt.InputError, ImportError) as error:
    said = str(error)
print(json.dumps({"found": found, "said": said, "names": dir(tt)}))
"""
EVERY = None  # picture is chosen, so that all are made
# The seconds of two pictures differ; and a fast form has another hierarchy, of which it counts the nodes and triangles.
WORK = ("MapRenderer: seconds", "MapRenderer: nodes", "MapRenderer: triangles")
QUICK = ("A1Renderer: normal", "A4Renderer: path")

# Wing → what needs it, and what is said.
NEED = {
    "apps": ("tt.show", "this installation has no taichi_tracer/apps, which has"),
    "cluster": ("tt.cluster", "this installation has no taichi_tracer/cluster, which renders"),
    "course": ("tt.course('.')", "this installation has no taichi_tracer/course, which runs files"),
    "explain": ("tt.A1Renderer(scene, 8, 8).explain(1, 1)", "this installation has no taichi_tracer/explain, which"),
    "fast": ("scene.receipt()", "this installation has no fast forms"),
    "rt3": ("tt.load_scene_data('rt3/two_views')", ".xml: this installation has no taichi_tracer/rt3, which reads"),
    "contracts": (
        "__import__('taichi_tracer.system.wings', fromlist=['wing']).wing('contracts.steps', 'check-part')",
        "check-part: this installation has no taichi_tracer/contracts, which checks parts",
    ),
    "studies": ("tt.studies.accuracy('cube')", "this installation has no taichi_tracer/studies, which measures"),
    "teaching": ("tt.teaching", "this installation has no taichi_tracer/teaching, which hands out"),
}
NAMES = {"apps": {"show"}, "rt3": {"RT3Renderer"}} | {
    name: {name} for name in ("cluster", "course", "studies", "teaching")
}


@pytest.fixture
def told(tmp_path):
    """Runs the program without a wing, and returns what it found."""
    return lambda wing, pictures: run(tmp_path, [wing], pictures, NEED[wing][0])


def run(folder: Path, wings: list[str], pictures: tuple[str, ...] | None, missing: str = "''") -> dict:
    """What the program finds in a copy of the package without some wings."""
    return json.loads(printed(copy_without(folder, *wings), PROGRAM, json.dumps(pictures), missing))


@cache
def whole(folder: Path, pictures: tuple[str, ...] | None) -> dict:
    """What the program finds in the whole package."""
    return run(folder, [], pictures)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the whole package is copied to."""
    return tmp_path_factory.mktemp("whole")


def test_every_wing_is_tried():
    assert set(NEED) == set(WINGS)


@pytest.mark.parametrize("wing", long_except(sorted(WINGS)))
def test_without_a_wing_pictures_and_rays_have_the_same_bits(wing, told, folder):
    there, here = whole(folder, QUICK), told(wing, QUICK)
    assert here["found"] == there["found"]
    assert {*QUICK, "occluded", "distance"} < set(here["found"])
    assert NEED[wing][1] in here["said"]
    assert "\n" not in here["said"]
    assert set(there["names"]) - set(here["names"]) == NAMES.get(wing, set())


def test_without_all_wings_together_pictures_and_rays_have_the_same_bits(folder, tmp_path):
    there, here = whole(folder, QUICK), run(tmp_path, sorted(WINGS), QUICK)
    assert here["found"] == there["found"]
    assert set(there["names"]) - set(here["names"]) == set().union(*NAMES.values())
