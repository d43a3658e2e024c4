"""What is kept between runs: arrays come back as they were, and a file that is damaged counts as missing."""

import numpy as np
import pytest

from taichi_tracer.teaching import kept

GROUPS = {"A.f": {"x": np.arange(3.0)}, "picture: a/b": {"y": np.ones((2, 2)), "z": np.array(1)}}


def test_groups_of_arrays_are_kept(tmp_path):
    path = tmp_path / "new folder" / "arrays.npz"
    kept.keep_arrays(path, kept.joined(GROUPS))
    found = kept.parted(kept.arrays_in(path))
    assert {group: list(arrays) for group, arrays in found.items()} == {"A.f": ["x"], "picture: a/b": ["y", "z"]}
    np.testing.assert_array_equal(found["A.f"]["x"], GROUPS["A.f"]["x"])
    assert [file.name for file in path.parent.iterdir()] == ["arrays.npz"]


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"no zip", None])
def test_a_damaged_file_counts_as_missing(content, tmp_path):
    path = tmp_path / "arrays.npz"
    if content is not None:
        path.write_bytes(content)
    assert kept.arrays_in(path) is None


def test_a_folder_that_cannot_be_written_costs_nothing_else(tmp_path):
    (tmp_path / "file").write_text("")
    kept.keep_arrays(tmp_path / "file" / "arrays.npz", {"x": np.zeros(1)})


def test_the_folder_is_chosen_by_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv(kept.VARIABLE, str(tmp_path))
    assert kept.cache_folder() == tmp_path / "teaching"
    monkeypatch.delenv(kept.VARIABLE)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "x"))
    assert kept.cache_folder() == tmp_path / "x" / "taichi_tracer" / "teaching"
