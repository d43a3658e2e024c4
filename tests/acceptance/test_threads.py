"""Several threads ask one scene, or render scenes of their own: each gets what one thread alone gets."""

import json
import os
import subprocess
import sys

import pytest

PROGRAM = """
import json, os, sys
from concurrent.futures import ThreadPoolExecutor
import numpy as np
import taichi_tracer as tt

def ask(scene):
    return scene.intersect([[0, 1, 3]] * 100, [[0, 0, -1]] * 100).distance.tolist()[0]

def picture(name):
    renderer = tt.A2Renderer(tt.load_scene_data(name, environment="white"), 16, 16)
    return float(renderer.use("hemisphere").render(16).image().mean())

def main():
    names = ["cube", "sphere", "torus_knot", "cube"]
    if sys.argv[1] == "threads":
        with ThreadPoolExecutor(4) as pool:
            pictures = list(pool.map(picture, names))
            scene = tt.load_scene_data("cube")
            answers = list(pool.map(ask, [scene] * 8))
    else:
        pictures, scene = [picture(name) for name in names], tt.load_scene_data("cube")
        answers = [ask(scene) for _ in range(8)]
    print("found", json.dumps([pictures, answers]))

main()
"""


def run(tmp_path, how):
    """What the program finds, in a process of its own with the kernel cache of this test."""
    file = tmp_path / "program.py"
    file.write_text(PROGRAM)
    environment = {"TI_OFFLINE_CACHE_FILE_PATH": str(tmp_path / "kernels")}
    done = subprocess.run(
        [sys.executable, file, how], capture_output=True, text=True, timeout=200, env=os.environ | environment
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout.split("found ")[1])


@pytest.mark.slow
def test_threads_get_the_answers_of_one_thread_cold_and_warm(tmp_path):
    cold, warm, alone = run(tmp_path, "threads"), run(tmp_path, "threads"), run(tmp_path, "alone")
    assert cold == warm == alone
    assert alone[1] == [2.0] * 8
