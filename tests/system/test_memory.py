"""Fields live as long as their owner; using them afterwards is an error, and forgetting them frees the memory."""

import gc
import time

import numpy as np
import pytest
import taichi as ti
from support import needs_patch, start

import taichi_tracer as tt
from taichi_tracer.system import compiling, direct, memory


@pytest.fixture(autouse=True)
def fresh():
    """Taichi in f32 on the CPU, whatever the test before did to it."""
    start("f32")


@pytest.fixture(autouse=True, scope="module")
def afterwards():
    """Nothing that these tests do to Taichi is left for the tests of other files."""
    yield
    start("f32")


def numbers(count=4):
    """(memory, a field in it)."""
    owner = memory.Memory()
    field = ti.field(ti.i32)
    owner.fields.dense(ti.i, count).place(field)
    owner.allocate()
    return owner, field


@pytest.mark.parametrize("again", [lambda: ti.init(arch=ti.cpu, log_level=ti.ERROR), ti.reset])
def test_a_lifetime_ends_with_its_start_of_taichi(again):
    lifetime = memory.Lifetime()
    assert not lifetime.is_over()
    lifetime.check("scene")
    again()
    assert lifetime.is_over()
    with pytest.raises(tt.StaleSceneError, match="this scene was made before Taichi was initialised again"):
        lifetime.check("scene")


def test_fields_are_usable_until_they_are_freed():
    owner, field = numbers()
    field[3] = 7
    assert field[3] == 7
    owner.check("thing")
    owner.free()
    assert owner.is_over()
    with pytest.raises(tt.StaleSceneError, match="this thing was destroyed"):
        owner.check("thing")
    owner.free()  # once more does nothing


def test_freeing_what_a_new_start_has_freed_does_nothing():
    owner, _ = numbers()
    tt.init("cpu", force=True)
    assert owner.is_over()
    with pytest.raises(tt.StaleSceneError, match="was made before Taichi was initialised again"):
        owner.check("thing")
    owner.free()


def test_fields_without_an_owner_are_freed_when_others_are_made(monkeypatch):
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
    """Leave fields behind whose owner no longer exists, and none of earlier tests."""
    gc.collect()
    memory._free_orphans()
    numbers(count)
    gc.collect()


def test_kernels_are_kept_while_little_waits_to_be_freed():
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


def test_much_memory_is_freed_when_others_are_made(monkeypatch):
    monkeypatch.setattr(memory, "MOST_BYTES_WAITING", 3999)
    abandoned(1000)
    assert len(memory._orphans) == 1
    other, _ = numbers()
    assert memory._orphans == []
    assert not other.is_over()


def test_memory_that_waits_is_freed_before_more_is_refused(monkeypatch):
    abandoned()
    monkeypatch.setattr(memory, "free_bytes", lambda: 100 if memory._orphans else 1000)
    memory.ask_for(500, "the film")
    assert memory._orphans == []


def test_a_field_that_no_kernel_used_can_be_freed():
    owner, _ = numbers()
    other, field = numbers()
    owner.free()
    field[0] = 3
    assert field[0] == 3
    other.free()


def test_after_an_error_between_making_and_placing_kernels_still_run():
    def fail_in_between():
        with memory.Memory() as fields:
            fields.dense(ti.i, 4).place(ti.field(ti.i32))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail_in_between()
    _, other = numbers()
    other[2] = 9
    assert other[2] == 9


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


@ti.kernel
def _double(field: ti.template()):
    for i in field:
        field[i] *= 2


@pytest.fixture
def asked(monkeypatch):
    """How many places each kernel was asked for that tells places."""
    needs_patch("memory")
    counts, ask = [], direct.places.root_addresses
    monkeypatch.setattr(direct.places, "root_addresses", lambda fields: counts.append(len(fields)) or ask(fields))
    return counts


def test_what_is_written_waits_for_a_reader_and_one_kernel_tells_all_places(asked):
    (first, a), (second, b), (third, c) = numbers(), numbers(), numbers()
    first.write(a, np.arange(len(a.to_numpy())))
    for owner, field in ((second, b), (third, c)):
        owner.write(field, np.full(field.shape, 3))
    third.clear(c)
    assert asked == []
    _double(b)
    assert asked == [3]
    np.testing.assert_array_equal(a.to_numpy(), np.arange(a.shape[0]))
    np.testing.assert_array_equal(b.to_numpy(), 6)
    np.testing.assert_array_equal(c.to_numpy(), 0)  # cleared after it was written
    second.write(b, np.full(b.shape, 5))  # its place is known
    np.testing.assert_array_equal(second.read(b), 5)
    assert asked == [3]


def test_python_that_looks_at_a_cell_sees_what_was_written():
    owner, field = numbers()
    owner.write(field, np.full(field.shape, 4))
    assert field[1] == 4
    other, second = numbers()
    other.write(second, np.full(second.shape, 4))
    second[1] = 9
    assert (second[0], second[1]) == (4, 9)


def test_nothing_is_written_for_owners_whose_memory_was_freed(asked):
    (kept, field), (owner, other) = numbers(), numbers()
    owner.write(other, np.ones(other.shape))
    owner.free()
    kept.write(field, np.full(field.shape, 2))
    np.testing.assert_array_equal(kept.read(field), 2)
    assert asked == [1]


def test_what_waits_is_written_although_nobody_refers_to_the_owner():
    """A part of it may still be in use."""
    owner, field = numbers()
    owner.write(field, np.full(field.shape, 7))
    del owner
    gc.collect()
    _double(field)
    np.testing.assert_array_equal(field.to_numpy(), 14)


def test_large_arrays_and_many_do_not_wait(asked, monkeypatch):
    owner, field = numbers(memory.LARGE)
    owner.write(field, np.full(field.shape, 1, np.int32))
    assert asked == [1]
    monkeypatch.setattr(memory, "MOST_WRITES", 2)
    owners = [numbers() for _ in range(3)]
    for one, other in owners:
        one.write(other, np.full(other.shape, 2))
    assert asked == [1, 3]


def test_what_waits_is_kept_if_the_kernel_is_interrupted(monkeypatch):
    needs_patch("memory")
    owner, field = numbers()
    owner.write(field, np.full(field.shape, 6))
    with monkeypatch.context() as patch:
        patch.setattr(direct.places, "root_addresses", lambda fields: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            _double(field)
    _double(field)
    np.testing.assert_array_equal(field.to_numpy(), 12)
