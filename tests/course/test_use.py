"""``tt.course(folder)`` and ``--course``: a student's files in all pictures, and the comparison with the reference."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.course.use import in_use
from taichi_tracer.system.parts import assigned

HAND_IN = Path(__file__).parent / "handin"
WRONG = ("w * n0 + u * n1 + v * n2", "u * n0 + v * n1 + w * n2")  # a real mistake
SIZE = 24


@pytest.fixture(autouse=True)
def in_f32(f32):
    """Taichi in f32; afterwards nobody's files are in use."""
    yield
    if in_use() is not None:
        in_use().undo()
    assert assigned() == []


@pytest.fixture
def folder(tmp_path):
    """A student's folder, as it is on a student's machine."""
    return Path(shutil.copytree(HAND_IN, tmp_path / "A1_codebase" / "taichi_tracer")).parent


def change(folder, file, old, new):
    path = folder / "taichi_tracer" / file
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def normals(name="sphere"):
    return np.asarray(
        tt.A1Renderer(tt.load_scene_data(name, intersector="brute_force"), SIZE, SIZE).use("normal").image()
    )


def test_a_folder_of_an_assignment_whose_ids_count_from_0_is_refused(folder):
    (folder / "taichi_tracer" / "assignment.json").write_text("{}")
    with pytest.raises(tt.InputError, match="this is a folder of assignment new"):
        tt.course(folder)


def test_files_are_used_in_every_picture_and_answer_until_the_end(folder):
    expected = normals("cube")
    change(folder, "ray_intersector.py", "hit_data.distance = t", "hit_data.distance = 2 * t")
    with tt.course(folder) as files:
        scene = tt.load_scene_data("cube")
        far = scene.intersect([0, 0.5, 5], [0, 0, -1]).distance
        assert "RayIntersector.intersect_triangle" in str(files)
        assert {"Camera.generate_ray", "RayIntersector.query_ray"} <= set(assigned())
        np.testing.assert_allclose(normals("cube"), expected, atol=1e-5)
        assert any("replaces" in line for line in scene.receipt())
    near = tt.load_scene_data("cube").intersect([0, 0.5, 5], [0, 0, -1]).distance
    np.testing.assert_allclose(far, 2 * near, rtol=1e-6)


def test_a_mistake_is_seen_beside_the_reference(folder):
    change(folder, "ray_intersector.py", *WRONG)
    with tt.course(folder) as files:
        theirs = normals()
        with files.reference():
            own = normals()
        assert np.array_equal(normals(), theirs)
    assert np.abs(theirs - own).max() > 0.01


def test_a_file_that_cannot_be_used_is_told_and_the_others_are_used(folder):
    change(folder, "camera.py", "from .ray import Ray", "from .ray import Raay")
    with tt.course(folder) as files:
        assert files.errors["camera.py"].startswith("camera.py:5: ImportError: cannot import name 'Raay'")
        assert "Camera.generate_ray" not in assigned()
        assert "RayIntersector.intersect_triangle" in assigned()


def test_a_scene_without_lamps_is_shaded_by_assignment_2_in_the_renderer_of_assignment_3(folder):
    scene = tt.load_scene_data("cube", environment="studio")
    expected = tt.A3Renderer(scene, SIZE, SIZE).use("brdf").render(256).image().mean()
    with tt.course(folder):
        scene = tt.load_scene_data("cube", environment="studio")
        theirs = tt.A3Renderer(scene, SIZE, SIZE).use("brdf").render(256).image().mean()
    # ti.random has no seed: the mean of these samples varies by 1.1 %, so that 1 test in a million fails by chance.
    assert theirs == pytest.approx(expected, rel=5 * 0.011)
