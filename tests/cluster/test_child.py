"""The process that renders: its folder, a disk without room, and the ranges of an adaptive picture."""

import errno
import os

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.cluster import child, parcels_of
from taichi_tracer.cluster.child import Desk, Stand, new_folder, samples_of
from taichi_tracer.cluster.parcel import hash_of

WHICH = (0, 0, None)
OPTIONS = {"scene": "cube", "estimator": "brdf", "intersector": "brute_force", "size": (12, 8), "arch": "cpu"}


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(tt.InputError, match="no folder for the scene can be made there"):
        new_folder(str(tmp_path / "file"))


@pytest.mark.parametrize(
    "make",
    [
        lambda folder, message, pieces: Desk(folder, None).receive(message, pieces),
        lambda folder, message, pieces: Stand(folder, None, message, pieces),
    ],
)
def test_a_disk_without_room_is_told_and_nothing_stays(make, tmp_path, monkeypatch):
    message = {"id": "a", "options": "{}", "files": [["scene/big.obj", [hash_of(b"v")]]]}

    def full(*_words, **_options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("taichi_tracer.files.disk.tempfile.mkstemp", full)
    with pytest.raises(tt.InputError, match=r"big\.obj: cannot be written \(No space left on device\)"):
        make(str(tmp_path), message, {hash_of(b"v"): b"v"})
    assert not any(path.is_file() for path in tmp_path.rglob("*"))


def test_samples_of_a_part_are_those_of_all_its_ranges():
    assert samples_of({"ranges": [[0, 3], [7, 9]]}) == 5


def test_the_memory_is_known_where_the_system_tells():
    assert child.most_memory() >= 0


@pytest.mark.exhaustive
def test_ranges_of_an_adaptive_picture_give_the_bits_of_one_process(tmp_path):
    """Each process takes the pilot itself; here, one takes it for its ranges, and another renderer for the picture."""
    start("f32")
    (parcel,), _ = parcels_of([OPTIONS | {"adaptive": True}])
    desk = Desk(str(tmp_path), None)
    desk.receive(parcel.message(), {})
    done = [desk.render(parcel.id, WHICH, a, b - a) for a, b in ((0, 5), (5, 6), (6, 20))]
    whole = desk.merge(parcel.id, WHICH, [desk.merge(parcel.id, WHICH, done[:2]), done[2]])
    facts = child.facts_of(desk.renderer_of(parcel.id, WHICH))
    assert "adaptive pilot" in facts
    scene = tt.load_scene_data("cube", environment="studio", intersector="brute_force")
    alone = tt.A2Renderer(scene, 12, 8, adaptive=True).use("brdf")
    alone.render(1)
    while alone.film.samples < 20:  # passes, in which not every pixel takes a sample
        alone.add_sample(alone.film.samples)
        alone.film.samples += 1
    assert child.facts_of(alone) == facts
    film = alone.film.alike()
    film.from_arrays(whole["arrays"], 20)
    np.testing.assert_array_equal(film.image(), alone.image())
    assert alone.shares.mean < 1
    desk.close()
