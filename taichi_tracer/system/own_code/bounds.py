"""Indices of fields in somebody's own functions: one beyond the field is told, and never reads foreign memory.

While a kernel is read, each index in such a function is kept within its field, and one that was not is noted in an
array, see ``taichi_17.bounds``. After the kernel has run, the first of them is told. If there is none, the
kernel is read again without this, because it makes a search among triangles take up to twice as long. Kernels without
an index of somebody's own are not touched.
"""

import hashlib
import linecache
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import taichi as ti

from taichi_tracer.system.cache import cache_folder, wanted_folder
from taichi_tracer.system.own_code.source import fault_at
from taichi_tracer.system.trial import read, write

MOST_PLACES = 256  # indices in the text of own functions that are watched; later ones are not
MOST_FILES = 1000  # that are kept
NUMBERS = 3  # of each: whether it was beyond, the index, the number of elements


class Place(NamedTuple):
    """An index in a function: its file, its line, the axis of the field, and how many elements there were."""

    file: str
    line: int
    axis: int
    elements: int

    @property
    def key(self) -> str:
        """What identifies it in its file. The same line with another mesh is another index."""
        return f"{self.line}:{self.axis}:{self.elements}"


class Kept:
    """The indices that were within bounds, in this process or in another one: kept beside the compiled kernels.

    A file that has changed since is another file.
    """

    def __init__(self) -> None:
        self._marks: dict[str, str] = {}
        self._known: dict[str, list[str]] | None = None

    def mark(self, file: str) -> str:
        """What identifies a file with its present text."""
        if file not in self._marks:
            linecache.checkcache(file)
            text = "".join(linecache.getlines(file))
            self._marks[file] = hashlib.sha256(f"{file}\0{text}".encode()).hexdigest()
        return self._marks[file]

    def has(self, place: Place) -> bool:
        """Whether an index was within bounds."""
        path = path_of_kept()
        if self._known is None:
            self._known = {} if path is None else read(path)
        return place.key in self._known.get(self.mark(place.file), [])

    def keep(self, places: set[Place]) -> None:
        """Note indices that were within bounds, for other processes."""
        path = path_of_kept()
        if path is None:
            return
        known = read(path)
        for place in sorted(places):
            found = known.pop(self.mark(place.file), [])
            known[self.mark(place.file)] = sorted({*found, place.key})
        write(path, dict(list(known.items())[-MOST_FILES:]))


def path_of_kept() -> Path | None:
    """The file of what is kept; None if no folder can be written."""
    folder, _ = cache_folder(wanted_folder())
    return None if folder is None else folder / "taichi_tracer_indices.json"


class Watch:
    """The indices that are watched.

    Attributes:
        is_wanted: whether a function of somebody's own has an index. places: where they stand. found: the array.
        forget: for each kernel (and Taichi's key of its objects) that was read with watched indices: what lets Taichi
            read it again, and where these indices stand.
        proven: those that have run without an index beyond its field, until they are read again.
    """

    def __init__(self) -> None:
        self.is_wanted = False
        self.places: list[Place] = []
        self.found: Any = None
        self._memory: Any = None
        self.forget: list[tuple[Any, Callable[[], None], set[Place]]] = []
        self.proven: list[Any] = []
        self.kept = Kept()

    def prepare(self) -> None:
        """Make the array, before Python reads a kernel; kernels cannot make fields."""
        from taichi_tracer.system.arrays import are_possible
        from taichi_tracer.system.memory import Memory

        is_gone = self._memory is None or self._memory.is_over()
        if is_gone:
            self.found = None  # on a GPU and in debug mode there is none, and nothing is watched
        if self.is_wanted and is_gone and are_possible():
            self._memory = Memory()
            self.found, self.places = ti.field(ti.i32), []
            self._memory.fields.dense(ti.i, NUMBERS * MOST_PLACES).place(self.found)
            self._memory.allocate()

    def number_of(self, place: Place) -> int | None:
        """The number of a place; None if there are too many."""
        if place not in self.places:
            if len(self.places) == MOST_PLACES:
                return None
            self.places.append(place)
        return self.places.index(place)

    def check(self) -> None:
        """Let Taichi read again what has run with watched indices; if one was beyond its field, tell the first.

        Raises:
            OwnCodeError: with the file and the line.
        """
        ti.sync()
        found = np.array(self._memory.read(self.found)).reshape(-1, NUMBERS)
        beyond = np.flatnonzero(found[:, 0])
        for reading, forget, places in self.forget:
            forget()
            if len(beyond) == 0:
                self.proven.append(reading)
                self.kept.keep(places)
        self.forget.clear()
        if len(beyond) > 0:
            self._memory.write(self.found, np.zeros(found.size, np.int32))
            place, (_, index, count) = self.places[beyond[0]], found[beyond[0]]
            axis = f"axis {place.axis} of " if place.axis > 0 else ""
            text = f"index {index} is beyond {axis}the field, which has {count} elements, 0 to {count - 1}"
            raise fault_at(place.file, place.line, text)


WATCH = Watch()
