"""Fields live as long as their owner; using them afterwards is an error, and forgetting them frees the memory."""

import contextlib
import gc
import time
import weakref

import numpy as np
import pytest
import taichi as ti
from support import needs_arrays, start, without_arrays

import taichi_tracer as tt
from taichi_tracer.system import arrays, compiling, memory


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


@pytest.mark.parametrize("again", [lambda: ti.init(arch=ti.cpu, log_level=ti.ERROR), ti.reset])
def test_a_lifetime_ends_with_its_start_of_taichi(again):
    lifetime = memory.Lifetime()
    assert not lifetime.is_over()
    lifetime.check("scene")
    again()
    assert lifetime.is_over()
    with pytest.raises(tt.StaleSceneError, match="this scene was made before Taichi was initialised again"):
        lifetime.check("scene")


def test_fields_are_usable_until_they_are_freed(each_kind):
    owner, field = numbers()
    field[3] = 7
    assert field[3] == 7
    owner.check("thing")
    owner.free()
    assert owner.is_over()
    with pytest.raises(tt.StaleSceneError, match="this thing was destroyed"):
        owner.check("thing")
    owner.free()  # once more does nothing


def test_freeing_what_a_new_start_has_freed_does_nothing(each_kind):
    owner, _ = numbers()
    tt.init("cpu", force=True)
    assert owner.is_over()
    with pytest.raises(tt.StaleSceneError, match="was made before Taichi was initialised again"):
        owner.check("thing")
    owner.free()


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


def abandoned(count=4):
    """Leave fields of Taichi's behind whose owner no longer exists, and none of earlier tests."""
    gc.collect()
    memory._free_orphans()
    numbers(count)
    gc.collect()


def test_kernels_are_kept_while_little_waits_to_be_freed(taichis):
    """When Taichi frees fields, Python must read all kernels again: a few small fields are not worth that."""
    abandoned()
    owner, field = numbers()

    @ti.kernel
    def count():
        field[0] += 1

    count()
    began = time.perf_counter()
    other, _ = numbers()
    count()
    assert len(memory._orphans) == 1
    assert not owner.is_over()
    assert not other.is_over()
    assert compiling.kernels(since=began) == []
    assert field[0] == 2


def test_much_memory_is_freed_when_others_are_made(taichis, monkeypatch):
    monkeypatch.setattr(memory, "MOST_BYTES_WAITING", 3999)
    abandoned(1000)
    assert len(memory._orphans) == 1
    other, _ = numbers()
    assert memory._orphans == []
    assert not other.is_over()


def test_memory_that_waits_is_freed_before_more_is_refused(taichis, monkeypatch):
    abandoned()
    monkeypatch.setattr(memory, "free_bytes", lambda: 100 if memory._orphans else 1000)
    memory.ask_for(500, "the film")
    assert memory._orphans == []


def test_a_field_that_no_kernel_used_can_be_freed(each_kind):
    owner, _ = numbers()
    other, field = numbers()
    owner.free()
    field[0] = 3
    assert field[0] == 3
    other.free()


def test_after_an_error_between_placing_and_allocating_kernels_still_run(each_kind):
    def fail_in_between():
        with memory.Memory() as fields:
            fields.dense(ti.i, 4).place(ti.field(ti.i32))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail_in_between()
    _, other = numbers()
    other[2] = 9
    assert other[2] == 9
    double(other)
    assert other[2] == 18


def test_what_a_block_places_is_allocated_at_its_end():
    owner = memory.Memory()
    with owner as fields:
        field = ti.field(ti.i32)
        fields.dense(ti.i, 4).place(field)
    field[1] = 2
    assert field[1] == 2
    assert not owner.is_over()


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


def test_what_is_free_is_more_than_nothing_where_it_is_known():
    free = memory.free_bytes()
    assert free is None or 2**20 < free < 2**50


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


def test_fields_of_an_owner_that_was_freed_tell_so():
    needs_arrays()
    owner, field = numbers()
    field[1] = 5
    owner.free()
    uses = [
        lambda: field[1],
        lambda: field.__setitem__(1, 2),
        lambda: field.shape,
        lambda: field.to_numpy(),
        lambda: field.from_numpy(np.zeros(4, np.int32)),
        lambda: field.fill(1),
    ]
    for use in uses:
        with pytest.raises(tt.StaleSceneError, match="this field was destroyed together with its owner"):
            use()
    for use in (lambda: owner.write(field, 1), lambda: owner.read(field), lambda: owner.clear(field)):
        with pytest.raises(tt.StaleSceneError, match="this field was destroyed"):
            use()


def test_fields_are_usable_while_somebody_has_them():
    """Although nobody refers to their owner."""
    needs_arrays()
    owner, field = numbers()
    owner.write(field, 7)
    del owner
    gc.collect()
    numbers()
    double(field)
    np.testing.assert_array_equal(field.to_numpy(), 14)


def memory_of(field):
    """A weak reference to the memory that a field and all views of it share."""
    array = field.numbers()
    while array.base is not None:
        array = array.base
    return weakref.ref(array)


@pytest.mark.parametrize("is_used", [False, True])
def test_memory_that_nobody_has_is_freed_at_once(is_used):
    """Also if Python used it; nothing of it waits."""
    needs_arrays()
    waiting = len(memory._orphans)
    owner, field = numbers()
    if is_used:
        field[1] = field[0]
    found = memory_of(field)
    assert found() is not None
    del owner, field
    gc.collect()
    assert found() is None
    assert len(memory._orphans) == waiting


def test_freeing_gives_the_memory_back_although_somebody_has_the_field():
    needs_arrays()
    owner, field = numbers()
    field[0] = 1
    found = memory_of(field)
    owner.free()
    gc.collect()
    assert found() is None
