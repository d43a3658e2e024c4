"""The same picture, bit for bit: in another process, on one thread, and from two halves of its samples."""

import subprocess
import sys

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.system.registry import PARTS

PROGRAM = """
import sys, hashlib
import taichi_tracer as tt

def renderers():
    lit = tt.load_scene_data("specular_spheres", environment="studio")
    yield tt.A2Renderer(lit, 40, 40, seed=5).use("mis")
    for way, scene in (("explicit", "caustic_sphere"), ("path", "veach_plates")):
        renderer = tt.A4Renderer(tt.load_scene_data(scene), 40, 40, seed=5).use(way)
        renderer.rr_start_bounce, renderer.rr_termination_probability = 1, 0.3
        yield renderer

def digests():
    pictures = [renderer.render(6).image() for renderer in renderers()]
    return "digests " + " ".join(hashlib.sha256(picture.tobytes()).hexdigest() for picture in pictures)

if __name__ == "__main__":
    tt.init("cpu", threads=int(sys.argv[1]) or None)
    print(digests())
"""


pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def plain():
    """The same of a scene that compiles soonest, where traversal is not the point."""
    scene = tt.load_scene_data("cube", environment="studio", intersector="brute_force")
    return lambda **options: A2Renderer(scene, 40, 40, **{"seed": 5, **options}).use("mis")


@pytest.fixture(scope="module")
def box():
    """Makes renderers of paths with roulette."""
    scene = tt.load_scene_data("cornell_box", environment="studio")

    def made(way, **options):
        renderer = tt.A4Renderer(scene, 40, 40, **{"seed": 5, **options}).use(way)
        renderer.rr_start_bounce, renderer.rr_termination_probability = 1, 0.3
        return renderer

    return made


@pytest.mark.exhaustive
def test_threads_and_processes_do_not_matter(tmp_path):
    """Of direct light, and of paths with roulette."""
    program, names = tmp_path / "program.py", {"__name__": "here"}
    program.write_text(PROGRAM)
    exec(PROGRAM, names)
    here = names["digests"]()
    for threads in ("1", "0"):
        result = subprocess.run([sys.executable, program, threads], capture_output=True, text=True, timeout=240)
        assert here in result.stdout, result.stderr


@pytest.mark.exhaustive
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


@pytest.mark.exhaustive
@pytest.mark.parametrize("way", ["explicit", "path"])
def test_two_halves_of_paths_merged_are_the_whole(box, way):
    """In each pixel, although paths are as long as roulette says."""
    whole, first, second = box(way).render(16), box(way).render(9), box(way, first_sample=9).render(7)
    assert not np.array_equal(first.image(), second.image())
    first.film.merge(second.film)
    np.testing.assert_array_equal(first.image(), whole.image())


@pytest.mark.long
def test_another_seed_is_another_plain(plain):
    assert not np.array_equal(plain().render(2).image(), plain(seed=6).render(2).image())


@pytest.mark.long
def test_a_cropped_picture_is_the_crop_of_the_whole(plain):
    whole, part = plain().render(3), plain(crop=(10, 30, 5, 25)).render(3)
    np.testing.assert_array_equal(part.canvas.to_numpy()[10:30, 5:25], whole.canvas.to_numpy()[10:30, 5:25])


@pytest.mark.exhaustive
def test_a_path_does_not_depend_on_other_pixels(box):
    whole, part = box("path").render(3), box("path", crop=(10, 30, 5, 25)).render(3)
    np.testing.assert_array_equal(part.canvas.to_numpy()[10:30, 5:25], whole.canvas.to_numpy()[10:30, 5:25])
