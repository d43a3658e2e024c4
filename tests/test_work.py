"""How much work a picture is: rays, nodes and triangles, and how many kernels a command compiles.

These numbers do not depend on the clock or on the machine, so that a change which makes pictures slower without anybody
noticing is found here. If a change of them is meant, put the numbers of the message into ``WORK`` or ``KERNELS``.
"""

import functools
import inspect
import time
from collections import Counter

import pytest
import taichi as ti

import taichi_tracer as tt
from taichi_tracer import scene_in_kernels
from taichi_tracer.apps.cli import main
from taichi_tracer.intersectors import bvh
from taichi_tracer.system import compiling
from taichi_tracer.system.seams import in_kernels
from tests.support import needs_arrays, needs_patch, start

SIZE, SPP = 32, 2
UPDATE = "is {found!r} now, and was {wanted!r}: if this is meant, write it into {table} of {file}"

# What a method is counted as. Eye rays and rays that look for what they hit are "rays"; others ask whether there is
# anything on their way. "blocks" of triangles are asked at once, "triangles" are those that a ray passes on the inside.
FAST = {
    "nearest_place": "rays",
    "is_blocked": "shadow rays",
    "met_children": "nodes",
    "try_corners": "triangles",
    "solved": "triangles",
}
OF_BLOCKS = {"edges": "blocks"}
PLAIN = {"query_segment": "rays", "is_blocked": "shadow rays", "intersect_primitive": "triangles"}
COUNTED = ("rays", "shadow rays", "nodes", "blocks", "triangles")

# (scene, environment, integrator, form) → the nodes of its tree, and the work of SPP samples of SIZE² pixels.
WORK: dict[tuple, dict[str, int]] = {
    ("cornell_box", None, "path", "fast"): {
        "tree nodes": 3,
        "rays": 7067,
        "shadow rays": 4045,
        "nodes": 13746,
        "blocks": 20003,
        "triangles": 11538,
    },
    ("cornell_box", None, "path", "plain"): {
        "tree nodes": 41,
        "rays": 7067,
        "shadow rays": 4045,
        "nodes": 167354,
        "blocks": 0,
        "triangles": 28766,
    },
    ("specular_spheres", "studio", "mis", "fast"): {
        "tree nodes": 140,
        "rays": 2048,
        "shadow rays": 520,
        "nodes": 6548,
        "blocks": 2491,
        "triangles": 489,
    },
    ("specular_spheres", "studio", "mis", "plain"): {
        "tree nodes": 3467,
        "rays": 2048,
        "shadow rays": 520,
        "nodes": 45797,
        "blocks": 0,
        "triangles": 5755,
    },
    ("blob", "sunny", "brdf", "fast"): {
        "tree nodes": 3417,
        "rays": 2048,
        "shadow rays": 1142,
        "nodes": 19641,
        "blocks": 5700,
        "triangles": 1178,
    },
    ("veach_plates", None, "explicit", "fast"): {
        "tree nodes": 99,
        "rays": 6371,
        "shadow rays": 2994,
        "nodes": 19560,
        "blocks": 21185,
        "triangles": 11093,
    },
}

# Options of ``render`` → kernels that the command compiles, brute force with the test of Möller and Trumbore.
KERNELS: dict[tuple, dict[str, int]] = {
    ("--view", "normal"): {"PrimaryHits._trace_rays": 1, "ProgressiveRenderer._take_samples": 1},
    ("--estimator", "brdf"): {"ProgressiveRenderer._take_samples": 1},
}


@ti.data_oriented
class Work:
    """Counts calls of methods inside kernels."""

    def __init__(self) -> None:
        self.counts = ti.field(ti.i32, len(COUNTED))

    @ti.func
    def add(self, k: ti.template()):
        self.counts[k] += 1

    def counting(self, function, name):
        """A function for kernels that is counted, and otherwise does the same."""

        @functools.wraps(function)
        def called(*arguments):
            self.add(COUNTED.index(name))
            return function(*arguments)

        return in_kernels(called)

    def method(self, cls, name, counted_as):
        """The method of a class, which is counted."""
        original = inspect.getattr_static(cls, name)

        @functools.wraps(original)
        def called(this, *arguments):
            self.add(COUNTED.index(counted_as))
            return original.__get__(this, type(this))(*arguments)

        return in_kernels(called)

    def watch(self, part, methods):
        """Let methods of an object be counted."""
        cls = type(part)
        members = {name: self.method(cls, name, what) for name, what in methods.items()}
        part.__class__ = type(f"Counted{cls.__name__}", (cls,), members)


def work_of(name, environment, integrator, is_fast, monkeypatch):
    """The work of a picture, and the size of its tree."""
    start()
    monkeypatch.setattr(scene_in_kernels, "replaced", lambda part: ())  # what counts does what the package's methods do
    scene = tt.load_scene_data(name, environment=environment, fast=is_fast)
    tree, work = scene.ray_intersector, Work()
    work.watch(tree, FAST if is_fast else PLAIN)
    if is_fast:
        work.watch(tree.blocks, OF_BLOCKS)
    else:
        monkeypatch.setattr(bvh, "box_interval", work.counting(bvh.box_interval, "nodes"))
    kind = next(kind for kind in (tt.A2Renderer, tt.A4Renderer) if integrator in kind.names())
    renderer = kind(scene, SIZE, SIZE, integrator=integrator)
    renderer.use_tiles = False  # which would be chosen by the clock
    renderer.render(SPP)
    counted = dict(zip(COUNTED, map(int, work.counts.to_numpy()), strict=True))
    return {"tree nodes": tree.num_nodes, **counted}


@pytest.mark.long
@pytest.mark.parametrize(("name", "environment", "integrator", "form"), WORK)
def test_a_picture_is_as_much_work_as_it_was(name, environment, integrator, form, monkeypatch):
    case = name, environment, integrator, form
    found = work_of(name, environment, integrator, form == "fast", monkeypatch)
    wanted = WORK.get(case)
    assert found == wanted, UPDATE.format(found=found, wanted=wanted, table=f"WORK[{case}]", file=__file__)


@pytest.mark.parametrize("words", [("--view", "normal"), ("--estimator", "brdf")])
def test_a_command_compiles_as_many_kernels_as_it_did(words, tmp_path):
    start()
    tt.init("cpu", force=True)  # other tests have read the same kernels
    needs_patch("counters")
    needs_arrays()
    began = time.perf_counter()
    quick = ["--intersector", "brute_force", "--triangle-test", "moller_trumbore", "--arch", "cpu"]
    assert main(["render", "cube", *quick, *words, "--size", "16x16", "-o", str(tmp_path / "a.png")]) == 0
    found = dict(sorted(Counter(kernel.name for kernel in compiling.kernels(since=began)).items()))
    wanted = KERNELS.get(words)
    assert found == wanted, UPDATE.format(found=found, wanted=wanted, table=f"KERNELS[{words}]", file=__file__)
