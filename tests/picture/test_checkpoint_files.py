"""Files of samples: to the last bit, written whole or not at all, and refused where they are damaged."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.picture import checkpoint


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
    damaged = [b"", b"PNG", raw[:70], raw[: len(raw) // 2], raw[:-1]]
    for at in (raw.index('"seed": 0'.encode("utf-32-le")) + 32, len(raw) // 3, len(raw) // 2):
        flipped = bytearray(raw)  # in the facts, where another seed would be believed, and in the arrays
        flipped[at] ^= 1
        damaged.append(bytes(flipped))
    for bad in damaged:
        path.write_bytes(bad)
        with pytest.raises(tt.InputError, match="this is no checkpoint of taichi_tracer, or it is damaged"):
            checkpoint.read_checkpoint(path)
