"""Words of functions, classes and types, and what has none."""

import enum
import math
import types

import numpy as np
import pytest
import taichi as ti
from support import needs_trees, start
from taichi._lib import core

from taichi_tracer import ray
from taichi_tracer.formulas import hashes
from taichi_tracer.picture.film import Film
from taichi_tracer.system.taichi_17.words import describe, found, place_word, type_of, type_word, word


def function_of_a_test():
    """One of a file that may be another one in the next process."""


VALUES = {
    "taichi_tracer.formulas.hashes:pcg4d": hashes.pcg4d,
    "taichi_tracer.ray:Ray.at": ray.Ray.methods["at"],
    "taichi_tracer.formulas.hashes:": hashes,
    "math:sqrt": math.sqrt,
    "builtins:max": max,
    "types:SimpleNamespace": types.SimpleNamespace,
    "types:NoneType": type(None),
    "types:MethodType": types.MethodType,
    "dtype <f4": np.dtype(np.float32),
}


@pytest.mark.parametrize("text", VALUES)
def test_a_word_is_that_of_one_object(text):
    assert word(VALUES[text]) == text
    if not text.startswith("dtype"):
        assert found(text) is VALUES[text]


def with_number(number):
    """A function whose answer its word would not tell."""
    return lambda: number


class Own:
    """Another one."""


class Colour(enum.Enum):
    """One of a test."""

    RED = 1


NONE = [function_of_a_test, Colour, Colour.RED, with_number(2), lambda: 1, 3, np.dtype([("a", "f4")]), np.zeros(2)]


@pytest.mark.parametrize("value", NONE, ids=lambda value: type(value).__name__)
def test_what_a_test_or_a_student_writes_has_no_word(value):
    assert word(value) is None


def test_a_function_that_somebody_has_put_in_the_place_of_another_one_has_no_word(monkeypatch):
    monkeypatch.setattr(hashes, "pcg4d", function_of_a_test)
    assert word(hashes.pcg4d) is None


def test_a_class_that_only_joins_others_has_the_word_of_its_bases():
    bases = Film, ti.lang.matrix.MatrixType
    joined = type("Joined", bases, {"__module__": "taichi_tracer.fast.tiles"})
    assert word(joined) == f"taichi_tracer.fast.tiles:Joined of {[word(base) for base in bases]}"
    assert word(type("Joined", bases, {"__module__": "taichi_tracer.fast.tiles", "own": 1})) is None
    assert word(type("Joined", (Own,), {"__module__": "taichi_tracer.fast.tiles"})) is None


def test_types_of_taichi_come_back():
    start("f32")
    tensor = core.get_type_factory_instance().get_tensor_type([3, 2], ti.f32)
    for kind in (ti.f32, ti.u8, ti.i64, tensor):
        assert type_of(type_word(kind)) == kind
    assert word(ti.types.vector(3, ti.f32)) != word(ti.types.vector(3, ti.i32))
    assert word(ti.types.vector(3, ti.f32)) != word(ti.types.vector(4, ti.f32))
    assert word(ti.types.matrix(2, 2, ti.f32)) != word(ti.types.vector(4, ti.f32))


def node(*fields):
    """The places of fields in a new tree."""
    builder = ti.FieldsBuilder()
    builder.dense(ti.i, 5).place(*fields)
    builder.finalize()
    return [field.vars[0].ptr.snode() for field in fields]


def test_the_word_of_a_place_is_that_of_its_tree():
    start("f32")
    needs_trees()
    first = node(ti.field(ti.f32), ti.field(ti.f32))
    second = node(ti.field(ti.f32), ti.field(ti.i32))
    assert len({place_word(one) for one in (*first, *second)}) == 4
    assert place_word(first[0]) == place_word(first[0])
    tree = describe(second[0].parent)
    assert tree[3] == [5]
    assert [part[2] for part in tree[-1]] == ["f32", "i32"]
