"""Fields live as long as their owner; using them afterwards is an error, and forgetting them frees the memory."""

import contextlib
import gc

import numpy as np
import pytest
import taichi as ti
from support import start, without_arrays

import taichi_tracer as tt
from taichi_tracer.system.fields import arrays, memory


@pytest.fixture(autouse=True)
def fresh():
    """Taichi in f32 on the CPU, whatever the test before did to it."""
    start("f32")


@pytest.fixture(autouse=True, scope="module")
def afterwards():
    """Nothing that these tests do to Taichi is left for the tests of other files."""
    yield
    start("f32")


@pytest.fixture
def taichis():
    """Fields are Taichi's own, and not in numpy's memory."""
    with without_arrays():
        yield


@pytest.fixture(params=["numpy's memory", "Taichi's own"])
def each_kind(request):
    """First fields in numpy's memory, where there are any, and then Taichi's own."""
    with without_arrays() if request.param == "Taichi's own" else contextlib.nullcontext():
        yield


def numbers(count=4):
    """(memory, a field in it)."""
    owner = memory.Memory()
    field = ti.field(ti.i32)
    owner.fields.dense(ti.i, count).place(field)
    owner.allocate()
    return owner, field


@ti.kernel
def double(field: ti.template()):
    for i in field:
        field[i] *= 2


def test_fields_without_an_owner_are_freed_when_others_are_made(taichis, monkeypatch):
    """Taichi has room for 512 groups of fields: six hundred owners, one after the other, are none too many."""
    freed = []
    destroy = memory._destroy
    monkeypatch.setattr(memory, "_destroy", lambda *arguments: (freed.append(arguments), destroy(*arguments)))
    for _ in range(600):
        numbers()
    gc.collect()
    assert len(freed) > 500
    _, field = numbers()
    field[1] = 5
    assert (field[0], field[1]) == (0, 5)


@pytest.mark.parametrize(("needed", "is_too_much"), [(0, False), (89, False), (91, True), (10**18, True)])
def test_more_memory_than_is_free_is_refused_before_it_is_taken(monkeypatch, needed, is_too_much):
    """A tenth of what is free is left for others."""
    monkeypatch.setattr(memory, "free_bytes", lambda: 100)
    if is_too_much:
        with pytest.raises(tt.InputError, match="the film needs .* GB of memory"):
            memory.ask_for(needed, "the film")
    else:
        memory.ask_for(needed, "the film")
    monkeypatch.setattr(memory, "free_bytes", lambda: None)
    memory.ask_for(needed, "the film")  # nothing is known: nothing is refused


def test_what_is_written_is_read_by_python_and_by_kernels(each_kind):
    """Also where kernels copy."""
    owner, field = numbers()
    assert owner.has_arrays == arrays.are_possible()
    owner.write(field, np.arange(4))
    double(field)
    assert owner.read(field).tolist() == field.to_numpy().tolist() == [0, 2, 4, 6]
    assert field[3] == 6
    found = owner.read(field)
    found[:] = 0  # it is a copy
    assert field[3] == 6
