"""The process that renders: its folder, a disk without room, and the ranges of an adaptive picture."""

import errno
import os

import pytest

import taichi_tracer as tt
from taichi_tracer.cluster import child
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
