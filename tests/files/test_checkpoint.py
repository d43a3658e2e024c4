"""Files of samples: to the last bit, written whole or not at all, and refused where they are damaged."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.files import checkpoint


def test_what_is_written_is_read(tmp_path, rng):
    path, arrays = tmp_path / "a.checkpoint", {"x": rng.random((3, 4)), "n": np.arange(5)}
    checkpoint.write_checkpoint(path, {"seed": 3, "samples": [[0, 8]]}, arrays)
    facts, found = checkpoint.read_checkpoint(path)
    assert facts == {"seed": 3, "samples": [[0, 8]]}
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)
    assert [p.name for p in tmp_path.iterdir()] == ["a.checkpoint"]


def test_damage_is_noticed(tmp_path, rng):
    path = tmp_path / "a.checkpoint"
    facts = {"samples": [[0, 2]], "scene": "0123456789abcdef", "seed": 0, "crop": [0, 12, 0, 10]}
    arrays = {"values": rng.random((12, 10, 4, 3)).astype(np.float32), "counts": np.full((12, 10, 2), 2, np.int32)}
    checkpoint.write_checkpoint(path, facts, arrays)
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
