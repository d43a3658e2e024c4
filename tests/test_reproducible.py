"""The same picture, bit for bit: in another process, on one thread, and from two halves of its samples."""

import hashlib
import subprocess
import sys

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.system.registry import PARTS

PROGRAM = """
import sys, hashlib
import taichi_tracer as tt
tt.init("cpu", threads=int(sys.argv[1]) or None)
scene = tt.load_scene_data("specular_spheres", environment="studio")
image = tt.A2Renderer(scene, 40, 40, seed=5).use("mis").render(6).image()
print("digest", hashlib.sha256(image.tobytes()).hexdigest())
"""


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


@pytest.fixture(scope="module")
def scene():
    return tt.load_scene_data("specular_spheres", environment="studio")


@pytest.fixture
def picture(scene):
    return lambda **options: A2Renderer(scene, 40, 40, **{"seed": 5, **options}).use("mis")


@pytest.fixture(scope="module")
def plain():
    """The same of a scene that compiles soonest, where traversal is not the point."""
    scene = tt.load_scene_data("cube", environment="studio", intersector="brute_force")
    return lambda **options: A2Renderer(scene, 40, 40, **{"seed": 5, **options}).use("mis")


@pytest.mark.long
def test_threads_and_processes_do_not_matter(picture, tmp_path):
    program = tmp_path / "program.py"  # kernels need their source on disk
    program.write_text(PROGRAM)
    here = "digest " + hashlib.sha256(picture().render(6).image().tobytes()).hexdigest()
    for threads in ("1", "0"):
        result = subprocess.run([sys.executable, program, threads], capture_output=True, text=True, timeout=120)
        assert here in result.stdout, result.stderr


@pytest.mark.long
@pytest.mark.parametrize(
    "sampler", [pytest.param(s, marks=pytest.mark.long) if s == "independent" else s for s in PARTS.names("sampler")]
)
def test_two_halves_merged_are_the_whole(plain, sampler):
    whole = plain(sampler=sampler).render(16)
    first, second = plain(sampler=sampler).render(9), plain(sampler=sampler, first_sample=9).render(7)
    assert not np.array_equal(first.image(), second.image())
    first.film.merge(second.film)
    np.testing.assert_array_equal(first.image(), whole.image())
    np.testing.assert_allclose(first.error(), whole.error(), rtol=1e-4)


@pytest.mark.long
def test_another_seed_is_another_plain(plain):
    assert not np.array_equal(plain().render(2).image(), plain(seed=6).render(2).image())


@pytest.mark.long
def test_a_cropped_picture_is_the_crop_of_the_whole(plain):
    whole, part = plain().render(3), plain(crop=(10, 30, 5, 25)).render(3)
    np.testing.assert_array_equal(part.canvas.to_numpy()[10:30, 5:25], whole.canvas.to_numpy()[10:30, 5:25])
