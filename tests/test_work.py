"""How much work a picture is: rays, nodes and triangles, and how many kernels a command compiles.

These numbers do not depend on the clock or on the machine, so that a change which makes pictures slower without anybody
noticing is found here. If a change of them is meant, put the numbers of the message into ``WORK`` or ``KERNELS``.
"""

import time
from collections import Counter

import pytest

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.system import compiling
from tests.support import needs_arrays, needs_patch, start

SIZE, SPP = 32, 2
UPDATE = "is {found!r} now, and was {wanted!r}: if this is meant, write it into {table} of {file}"

PLAIN = {"query_segment": "rays", "is_blocked": "shadow rays", "intersect_primitive": "triangles"}

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
