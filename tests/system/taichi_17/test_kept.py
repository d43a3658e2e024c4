"""What one process has read, another one does not read; and it makes the same picture, whatever is missing.

Each test starts processes with a folder of their own.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import long_except, needs_arrays, needs_patch, needs_trees, start

from taichi_tracer.system.taichi_17 import kept

PROGRAM = """
import json, sys
import numpy as np
import taichi as ti
import taichi_tracer as tt
from taichi_tracer.formulas import hashes
from taichi_tracer.system import compiling
from taichi_tracer.system.taichi_17 import kept

kept.LONG = 0.0
seed, to = int(sys.argv[1]), sys.argv[2]
rng = np.random.default_rng(seed)
faces = np.array([rng.choice(60 + seed, 3, replace=False) for _ in range(120 + seed)])
scene = tt.scene_from_mesh(rng.normal(size=(60 + seed, 3)), faces, environment="studio")
{body}
np.save(to, renderer.render(2).image())
print(json.dumps({{kernel.name: kernel.reading_before > 0 for kernel in compiling.kernels()}}))
sys.exit(0)
"""
NORMAL = "renderer = tt.A1Renderer(scene, 16, 12).use('normal')"
SUN = """
sky = np.full((32, 64, 3), 0.3)
sky[6, 9 + seed] = 2000
scene = tt.scene_from_mesh(scene.mesh, environment=sky)
renderer = tt.A2Renderer(scene, 16, 12).use('environment')
renderer.render(2).error()
"""
MAP = "renderer = tt.MapRenderer(scene, 16, 12, of='mis').use('blocked')"
BODIES = {
    "a view": NORMAL,
    "one technique under a sun": SUN,
    "a map of work": MAP,
    "direct light": "renderer = tt.A2Renderer(scene, 16, 12).use('mis')",
    "tiles": "renderer = tt.A2Renderer(scene, 16, 12).use('mis'); renderer.use_tiles = True",
    "paths": "renderer = tt.A4Renderer(scene, 16, 12).use('path')",
}
VIEW = {"PrimaryHits._trace_rays", "ProgressiveRenderer._take_samples"}
LARGE = "ProgressiveRenderer._take_samples"


@pytest.fixture(autouse=True)
def possible():
    start("f32")
    needs_arrays()
    needs_patch("readings")
    needs_patch("counters")


class Processes:
    """Processes that share a folder of kernels.

    Args:
        folder: of their own.
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.kernels = folder, folder / "kernels"

    def run(self, body=NORMAL, seed=1, **variables):
        """(the picture, the names of the kernels that were kept, and of those that were read) of a process."""
        program, picture = self.folder / "program.py", self.folder / "picture.npy"
        program.write_text(PROGRAM.format(body=body))
        keys = {"TI_OFFLINE_CACHE": "1", "TI_OFFLINE_CACHE_FILE_PATH": str(self.kernels), **variables}
        words = [sys.executable, str(program), str(seed), str(picture)]
        done = subprocess.run(words, env={**os.environ, **keys}, check=True, capture_output=True, text=True)
        were_kept = json.loads(done.stdout.splitlines()[-1])
        named = [{name for name, was_kept in were_kept.items() if was_kept is wanted} for wanted in (True, False)]
        return np.load(picture), *named

    def readings(self):
        """Everything that is kept."""
        return [one for file in (self.kernels / kept.FOLDER).iterdir() for one in kept.kept_in(file)]


@pytest.fixture
def processes(tmp_path):
    return Processes(tmp_path)


@pytest.fixture
def begun(processes):
    """Processes of which one has kept the kernels of a view, and its picture."""
    picture, found, _ = processes.run()
    assert found == set()
    assert len(processes.readings()) == len(VIEW)
    return processes, picture


@pytest.mark.parametrize("name", ["a view", *(pytest.param(name, marks=pytest.mark.long) for name in [*BODIES][1:])])
def test_a_second_process_reads_nothing_large_and_makes_the_same_picture(processes, name):
    if name == "tiles":
        needs_trees()
    first, found, read = processes.run(BODIES[name])
    assert found == set()
    again, found, _ = processes.run(BODIES[name])
    assert found == read
    np.testing.assert_array_equal(again, first)
    other, found, _ = processes.run(BODIES[name], seed=2)
    assert found == read
    expected, found, _ = processes.run(BODIES[name], seed=2, TAICHI_TRACER_PATCHES="none")
    assert found == set()
    np.testing.assert_array_equal(other, expected)


@pytest.mark.parametrize("name", long_except(["both", "small", "large", "list", "readings"], "both"))
def test_what_is_missing_is_made_again(begun, name):
    processes, picture = begun
    for one in processes.readings():
        for kind in ("small", "large") if name == "both" else (name,):
            if kind in ("small", "large"):
                (processes.kernels / getattr(one, kind)).unlink()
    if name == "list":
        (processes.kernels / "ticache.tcb").unlink()
    if name == "readings":
        for file in (processes.kernels / kept.FOLDER).iterdir():
            file.write_bytes(file.read_bytes()[:100])
    again, found, _ = processes.run()
    assert found == (VIEW if name == "large" else set()), "the code of the large one has two names"
    np.testing.assert_array_equal(again, picture)
    again, found, _ = processes.run()
    assert found == (set() if name in ("both", "readings") else VIEW), "nothing tells the name of the code"
    np.testing.assert_array_equal(again, picture)
    again, found, _ = processes.run()
    assert found == VIEW, "it has another name"
    np.testing.assert_array_equal(again, picture)
    for one in processes.readings():
        if (processes.kernels / one.large).exists():
            assert (processes.kernels / one.large).stat().st_nlink == 1, "two names of one file would change together"


OWN = """
class Own(tt.A1Renderer):
    @ti.func
    def shade_ray(self, ray):
        return ti.Vector([0.25, 0.5, 0.5])

renderer = Own(scene, 16, 12)
"""


def test_what_a_student_writes_is_what_runs(begun):
    processes, picture = begun
    for green in (0.5, 0.75):
        own, found, read = processes.run(OWN.replace("0.5, 0.5", f"{green}, 0.5"))
        assert LARGE in read | {"Own._take_samples"}
        assert LARGE not in found
        np.testing.assert_allclose(own, np.broadcast_to([0.25, green, 0.5], own.shape))
    again, found, _ = processes.run()
    assert found == VIEW
    np.testing.assert_array_equal(again, picture)


def test_a_constant_that_somebody_has_changed_is_no_part_of_other_processes(processes):
    light = "renderer = tt.A2Renderer(scene, 16, 12).use('uniform')"
    changed, _, _ = processes.run(f"hashes.HALVES = hashes.HALVES[1:]\n{light}")
    picture, found, read = processes.run(light)
    assert LARGE in read
    assert not np.array_equal(changed, picture)
    again, found, _ = processes.run(light)
    assert LARGE in found
    np.testing.assert_array_equal(again, picture)


@pytest.mark.long
def test_nothing_is_kept_while_somebody_edits_the_package(processes):
    processes.run(f"kept._started = 0.0\n{NORMAL}")
    assert not (processes.kernels / kept.FOLDER).exists()


@pytest.mark.long
def test_after_a_change_of_the_package_kernels_are_read_once(processes):
    """Although their code is the same: the folder has it under another key."""
    changed = f"kept.files_now = kept.package_files = lambda: 'another time of a file'\n{NORMAL}"
    assert processes.run(changed)[1] == set()
    assert processes.run()[1] == set()
    assert processes.run()[1] == VIEW


@pytest.mark.long
def test_a_folder_that_cannot_be_written_is_no_error(processes):
    processes.kernels.mkdir()
    (processes.kernels / kept.FOLDER).write_text("a file in its place")
    first, found, _ = processes.run()
    again, found, _ = processes.run()
    assert found == set()
    np.testing.assert_array_equal(again, first)


@pytest.mark.long
def test_the_oldest_readings_go_with_their_code(begun):
    processes, picture = begun
    first = processes.readings()
    assert all((processes.kernels / one.small).exists() for one in first)
    processes.run(f"kept.MOST = kept.MOST_FILES = 1\n{BODIES['paths']}")
    assert len(processes.readings()) == 1
    assert not any((processes.kernels / one.small).exists() for one in first)
    for read_again in (set(), set(), VIEW):  # the second process gives the code keys whose names it learns
        again, found, _ = processes.run()
        assert found == read_again
        np.testing.assert_array_equal(again, picture)


@pytest.mark.long
def test_without_a_place_for_code_nothing_is_kept(processes):
    processes.run(TI_OFFLINE_CACHE="0")
    assert not (processes.kernels / kept.FOLDER).exists()
