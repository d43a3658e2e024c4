"""Frames: what is sent arrives, and nothing else is taken for a frame."""

import json
import os
import struct
import threading

import numpy as np
import pytest

from taichi_tracer.teaching import frames
from taichi_tracer.teaching.frames import Decoder, FrameError, encode


def raw(header: object, body: bytes = b"") -> bytes:
    """A frame with any header."""
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    return struct.pack("<8sI", frames.MAGIC, len(text)) + text + body


def described(**array) -> dict:
    """A header that describes one array."""
    return {"message": {}, "arrays": [{"name": "x", "dtype": "<f4", "shape": [2]} | array]}


ARRAYS = {
    "empty": np.zeros((0, 3)),
    "one": np.array(7),
    "floats": np.array([[1.5, np.nan, -np.inf]], np.float32),
    "bools": np.array([True, False]),
    "big endian": np.array([1, 2], ">i4"),
    "strided": np.arange(12).reshape(3, 4)[:, ::2],
    "half": np.ones(3, np.float16),
}


def test_what_is_sent_arrives():
    ((message, arrays),) = Decoder().feed(encode({"do": "run", "ü": [1, None]}, ARRAYS))
    assert message == {"do": "run", "ü": [1, None]}
    assert list(arrays) == list(ARRAYS)
    for name, values in ARRAYS.items():
        np.testing.assert_array_equal(arrays[name], values)
        assert arrays[name].dtype.newbyteorder("=") == values.dtype.newbyteorder("=")


@pytest.mark.parametrize("size", [1, 7, 100])
def test_frames_arrive_in_pieces(size):
    data, decoder, found = encode({"n": 1}, ARRAYS) + encode({"n": 2}), Decoder(), []
    for at in range(0, len(data), size):
        found += decoder.feed(data[at : at + size])
    assert [message["n"] for message, _ in found] == [1, 2]


def test_a_pipe_carries_frames():
    reader, writer = os.pipe()
    sent = {"values": np.arange(100_000.0)}
    thread = threading.Thread(target=lambda: (frames.write_bytes(writer, encode({"a": 1}, sent)), os.close(writer)))
    thread.start()
    message, arrays = frames.read(reader)
    np.testing.assert_array_equal(arrays["values"], sent["values"])
    assert message == {"a": 1}
    assert frames.read(reader) is None
    thread.join()
    os.close(reader)


@pytest.mark.parametrize(
    "data",
    [
        b"x",
        b"TTFRAME2" + bytes(4),
        frames.MAGIC + b"\xff\xff\xff\xff",
        raw(b"{"),
        raw(b"\xff\xfe"),
        raw(b"[" * 100_000),
        raw([]),
        raw({"message": 1, "arrays": []}),
        raw({"message": {}}),
        raw({"message": {}, "arrays": [1]}),
        raw(described(dtype="|O")),
        raw(described(dtype="<f8,<f8")),
        raw(described(dtype=["<f8"])),
        raw(described(name=1)),
        raw(described(shape=[-1])),
        raw(described(shape=[2.0])),
        raw(described(shape=[True])),
        raw(described(shape=[2**40])),
        raw(described(shape=[2**25, 2**25])),
        raw(described(shape=[0] * 9)),
        raw(described(shape="12")),
        raw({"message": {}, "arrays": described()["arrays"] * 2}),
        raw({"message": {}, "arrays": [{"name": str(i), "dtype": "<f4", "shape": [0]} for i in range(65)]}),
        raw({"message": {}, "arrays": [{"name": str(i), "dtype": "<f8", "shape": [2**22]} for i in range(4)]}),
    ],
    ids=lambda data: repr(data[12:60]),
)
def test_what_is_no_frame_is_refused(data):
    with pytest.raises(FrameError):
        Decoder().feed(data)


@pytest.mark.parametrize("values", [np.array([object()]), np.array(["a"]), np.array([1j]), [[1], [2, 3]]])
def test_only_numbers_can_be_sent(values):
    with pytest.raises((FrameError, ValueError)):
        encode({}, {"x": values})


def test_a_frame_that_is_too_large_is_not_sent():
    with pytest.raises(FrameError, match="too large"):
        encode({}, {"x": np.zeros(frames.MOST_BYTES // 8 + 1)})


def test_random_bytes_are_refused_or_wait(rng):
    for _ in range(200):
        data = bytearray(encode({"a": [1, 2]}, {"x": np.arange(5.0)}))
        for at in rng.integers(0, len(data), 3):
            data[at] = rng.integers(256)
        try:
            Decoder().feed(bytes(data))
        except FrameError:
            continue
