"""Checkpoints: to the last bit, atomic, and refused with a reason where something is wrong."""

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.files import checkpoint


def load(name, environment="studio"):
    return tt.load_scene_data(name, environment=environment, intersector="brute_force")  # compiles soonest


@pytest.fixture(scope="module")
def scene():
    start("f32")
    return load("cube")


def renderer(scene, **options):
    return tt.A2Renderer(scene, 12, 10, **options).use("brdf")


def test_what_is_written_is_read(tmp_path, rng):
    path, arrays = tmp_path / "a.checkpoint", {"x": rng.random((3, 4)), "n": np.arange(5)}
    checkpoint.write_checkpoint(path, {"seed": 3, "samples": [[0, 8]]}, arrays)
    facts, found = checkpoint.read_checkpoint(path)
    assert facts == {"seed": 3, "samples": [[0, 8]]}
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)
    assert [p.name for p in tmp_path.iterdir()] == ["a.checkpoint"]


def test_a_continued_picture_is_that_of_one_run(scene, tmp_path):
    whole, first, second = (renderer(scene) for _ in range(3))
    whole.render(13)
    first.render(6)
    first.save_checkpoint(tmp_path / "a.checkpoint")
    second.load_checkpoint(tmp_path / "a.checkpoint")
    assert second.samples == 6
    second.render(7)
    np.testing.assert_array_equal(second.image(), whole.image())
    np.testing.assert_array_equal(second.film.variance_of_mean(), whole.film.variance_of_mean())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: r.use("mis"), "another estimator: brdf there, mis here"),
        (lambda r: setattr(r, "seed", 4), "another seed: 0 there, 4 here"),
        (lambda r: r.camera.set_camera_parameters(fov=50), "another camera"),
        (lambda r: setattr(r, "first_sample", 3), "holds the samples 0 to 1, not those from 3 on"),
    ],
)
def test_samples_of_something_else_are_refused(scene, tmp_path, change, message):
    path = tmp_path / "a.checkpoint"
    renderer(scene).render(2).save_checkpoint(path)
    before, other = path.read_bytes(), renderer(scene)
    change(other)
    with pytest.raises(tt.InputError, match=message):
        other.load_checkpoint(path)
    assert path.read_bytes() == before


def test_another_scene_light_or_size_is_refused(scene, tmp_path):
    path = tmp_path / "a.checkpoint"
    renderer(scene).render(2).save_checkpoint(path)
    lit = load("cube", "white")
    for other in (renderer(lit), renderer(load("sphere"))):
        with pytest.raises(tt.InputError, match="another scene"):
            other.load_checkpoint(path)
    with pytest.raises(tt.InputError, match="another (camera|size)"):
        tt.A2Renderer(scene, 10, 12).use("brdf").load_checkpoint(path)


def test_damage_is_noticed(scene, tmp_path):
    path = tmp_path / "a.checkpoint"
    renderer(scene).render(2).save_checkpoint(path)
    raw = path.read_bytes()
    damaged = [raw[:n] for n in (len(checkpoint.MAGIC), len(checkpoint.MAGIC) + 70, len(raw) - 1)]
    for at in range(len(checkpoint.MAGIC), len(raw), len(raw) // 97):  # in the hash, the facts, and the arrays
        flipped = bytearray(raw)
        flipped[at] ^= 1
        damaged += [bytes(flipped)]
    flipped = bytearray(raw)
    flipped[raw.index(b'"seed": 0') + 8] ^= 1  # another seed would be believed
    for bad in (*damaged, bytes(flipped)):
        path.write_bytes(bad)
        with pytest.raises(tt.InputError, match="cut short or damaged|this is no checkpoint"):
            checkpoint.read_checkpoint(path)
    for bad in (b"", b"PNG"):
        path.write_bytes(bad)
        with pytest.raises(tt.InputError, match="this is no checkpoint"):
            checkpoint.read_checkpoint(path)


def test_ranges_join_where_they_touch_and_may_not_overlap():
    assert checkpoint.joined([[0, 4]], [[4, 9]]) == [[0, 9]]
    assert checkpoint.joined([[8, 9], [0, 2]], [[4, 6]]) == [[0, 2], [4, 6], [8, 9]]
    with pytest.raises(tt.InputError, match="samples 3 to 4 are in both"):
        checkpoint.joined([[0, 5]], [[3, 9]])


def test_views_have_nothing_to_keep(scene, tmp_path):
    with pytest.raises(tt.InputError, match="every sample of hit is the picture itself"):
        tt.A1Renderer(scene, 8, 8).use("hit").render().save_checkpoint(tmp_path / "a.checkpoint")
