"""Frames: messages between the grader and the process of a submission, over pipes.

The grader trusts nothing that comes from the other side. Therefore a frame contains no Python objects: it has a header
in JSON, and arrays of numbers as raw bytes. A frame is

    8 bytes    the letters TTFRAME1
    4 bytes    length of the header, little endian
    header     {"message": {...}, "arrays": [{"name", "dtype", "shape"}, ...]}
    arrays     their bytes in this order, little endian, the last axis first in memory

Whatever deviates from this, or is larger than ``MOST_BYTES``, raises a FrameError before memory for it is allocated.
"""

import json
import os
import struct

import numpy as np

MAGIC = b"TTFRAME1"
START = struct.Struct("<8sI")
DTYPES = ("|b1", "|i1", "|u1", "<i2", "<u2", "<i4", "<u4", "<i8", "<u8", "<f2", "<f4", "<f8")
MOST_HEADER = 1 << 20  # bytes of a header
MOST_ARRAYS = 64  # a part has up to ten
MOST_AXES = 8  # an image has three
MOST_BYTES = 64 << 20  # bytes of all arrays of a frame

Arrays = dict[str, np.ndarray]


class FrameError(ValueError):
    """What arrived is not a frame."""


def encode(message: dict, arrays: Arrays | None = None) -> bytes:
    """The bytes of a frame.

    Args:
        message: what JSON can hold. arrays: name → array of numbers.

    Raises:
        FrameError: an array has no numbers, or the frame would be too large.
    """
    facts, bodies = [], []
    for name, values in (arrays or {}).items():
        values = np.asarray(values)
        dtype = values.dtype.newbyteorder("<") if values.dtype.kind in "biuf" else values.dtype
        if dtype.str not in DTYPES:
            raise FrameError(f"the array {name!r} has no numbers: its dtype is {values.dtype}")
        facts.append({"name": str(name), "dtype": dtype.str, "shape": list(values.shape)})
        bodies.append(np.ascontiguousarray(values, dtype).tobytes())
    header = json.dumps({"message": message, "arrays": facts}).encode()
    size = sum(len(body) for body in bodies)
    if len(header) > MOST_HEADER or len(facts) > MOST_ARRAYS or size > MOST_BYTES:
        raise FrameError(f"a frame of {len(facts)} arrays and {size} bytes is too large")
    return b"".join([START.pack(MAGIC, len(header)), header, *bodies])


class Decoder:
    """Makes frames of bytes that arrive in pieces of any size."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._header: tuple[int, dict, list[tuple[str, str, tuple[int, ...]]]] | None = None  # of the first frame

    def feed(self, data: bytes) -> list[tuple[dict, Arrays]]:
        """The frames that are complete with these bytes.

        Raises:
            FrameError: the bytes are not those of a frame. The decoder cannot be used afterwards.
        """
        self._bytes += data
        frames = []
        while (frame := self._take()) is not None:
            frames.append(frame)
        return frames

    def _take(self) -> tuple[dict, Arrays] | None:
        """The first frame, which is removed; None if it is not complete."""
        if self._header is None:
            body = check_start(bytes(self._bytes[: START.size])) + START.size
            if len(self._bytes) < body:
                return None
            self._header = body, *parse_header(bytes(self._bytes[START.size : body]))
        at, message, facts = self._header
        sizes = [np.dtype(dtype).itemsize * count(shape) for _, dtype, shape in facts]
        if len(self._bytes) < at + sum(sizes):
            return None
        arrays = {}
        for (name, dtype, shape), size in zip(facts, sizes, strict=True):
            arrays[name] = np.frombuffer(bytes(self._bytes[at : at + size]), dtype).reshape(shape)
            at += size
        del self._bytes[:at]
        self._header = None
        return message, arrays


def check_start(start: bytes) -> int:
    """The length of the header, from the first bytes of a frame, as far as they are there."""
    if start[: len(MAGIC)] != MAGIC[: len(start)]:
        raise FrameError("the bytes do not begin a frame")
    if len(start) < START.size:
        return 0
    _, length = START.unpack(start)
    if length > MOST_HEADER:
        raise FrameError(f"a header of {length} bytes is too long")
    return length


def parse_header(text: bytes) -> tuple[dict, list[tuple[str, str, tuple[int, ...]]]]:
    """The message, and (name, dtype, shape) of every array."""
    try:
        header = json.loads(text)
        message, facts = header["message"], header["arrays"]
        found = [(fact["name"], fact["dtype"], tuple(fact["shape"])) for fact in facts]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise FrameError(f"the header cannot be read: {type(error).__name__}") from None
    if not isinstance(message, dict) or len(found) > MOST_ARRAYS:
        raise FrameError("the header has no message, or too many arrays")
    for name, dtype, shape in found:
        check_array(name, dtype, shape)
    if len({name for name, _, _ in found}) < len(found):
        raise FrameError("two arrays have one name")
    if sum(np.dtype(dtype).itemsize * count(shape) for _, dtype, shape in found) > MOST_BYTES:
        raise FrameError(f"the arrays have more than {MOST_BYTES} bytes")
    return message, found


def check_array(name: object, dtype: object, shape: tuple) -> None:
    """Raise a FrameError if a header describes an array that cannot be."""
    if not isinstance(name, str) or dtype not in DTYPES or len(shape) > MOST_AXES:
        raise FrameError("an array has no name, no dtype of numbers, or too many axes")
    if not all(isinstance(n, int) and not isinstance(n, bool) and 0 <= n <= MOST_BYTES for n in shape):
        raise FrameError(f"an array {name!r} cannot have the shape {str(shape)[:80]}")


def count(shape: tuple[int, ...]) -> int:
    """How many numbers an array of a shape has; Python's integers do not overflow."""
    total = 1
    for n in shape:
        total *= n
    return total


# ── for the side that may wait ──


def read(descriptor: int) -> tuple[dict, Arrays] | None:
    """Wait for one frame; None if the other side has closed the pipe. Only for pipes with one frame at a time."""
    decoder = Decoder()
    while data := os.read(descriptor, 1 << 16):
        if frames := decoder.feed(data):
            return frames[0]
    return None


def write_bytes(descriptor: int, data: bytes) -> None:
    """Write bytes, and wait until they are written."""
    rest = memoryview(data)
    while rest:
        rest = rest[os.write(descriptor, rest) :]
