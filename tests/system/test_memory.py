"""Fields in numpy's memory do what fields of Taichi do, and memory is freed with its owner."""

import contextlib
import gc

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import needs_arrays, start, without_arrays

import taichi_tracer as tt
from taichi_tracer.system import memory


@ti.dataclass
class Sample:
    """A struct with a number and a vector."""

    count: ti.i32
    colour: tm.vec3


@pytest.fixture(autouse=True)
def in_f32(f32):
    """Taichi with fields in numpy's memory."""
    needs_arrays()


class Store:
    """Fields of all kinds that the package has, by name."""

    def __init__(self):
        self.memory = memory.Memory()
        made = self.fields = {
            "matrix": ti.Matrix.field(4, 4, float),
            "number": ti.field(ti.i32),
            "table": ti.field(float),
            "vectors": ti.Vector.field(3, float),
            "ids": ti.Vector.field(3, ti.i32),
            "bytes": ti.Vector.field(8, ti.u8),
            "children": ti.field(ti.i32),
            "halves": ti.Vector.field(3, float),
            "half_counts": ti.field(ti.i32),
            "matrices": ti.Matrix.field(2, 3, float),
            "flags": ti.field(ti.u8),
            "doubles": ti.field(ti.f64),
            "lanes": ti.Vector.field(16, float),
        }
        root = self.memory.fields
        root.dense(ti.ij, (5, 4)).place(made["table"])
        root.dense(ti.i, 7).place(made["ids"], made["vectors"])
        node = root.dense(ti.i, 6)
        node.dense(ti.j, 6).place(made["bytes"])
        node.dense(ti.j, 8).place(made["children"])
        root.dense(ti.k, 2).dense(ti.ij, (5, 3)).place(made["half_counts"], made["halves"])
        root.dense(ti.i, 9).place(made["flags"]).place(made["doubles"], made["matrices"])
        root.dense(ti.ij, 3).place(made["lanes"])
        root.place(made["number"], made["matrix"])
        self.memory.allocate()


NAMES = [
    *("matrix", "number", "table", "vectors", "ids", "bytes", "children", "halves", "half_counts"),
    *("matrices", "flags", "doubles", "lanes"),
]


@pytest.fixture(scope="module")
def store(f32):
    """Fields in numpy's memory."""
    needs_arrays()
    return Store()


@pytest.fixture(scope="module")
def other_store(f32):
    """The same fields, as Taichi's own."""
    with without_arrays():
        return Store()


def values_for(field, rng):
    """Random numbers in the shape of a field."""
    array = field.to_numpy()
    return rng.integers(0, 200, array.shape).astype(array.dtype)


@ti.kernel
def read(field: ti.template(), found: ti.types.ndarray(dtype=ti.f64, ndim=2)):
    """All numbers, in the order of the indices and then of the components."""
    ti.loop_config(serialize=True)
    for i in ti.grouped(field):
        k = 0
        for axis in ti.static(range(len(field.shape))):
            k = k * field.shape[axis] + i[axis]
        if ti.static(hasattr(field, "m")):
            for c in ti.static(range(field.n * field.m)):
                if ti.static(field.m == 1):
                    found[k, c] = field[i][c]
                else:
                    found[k, c] = field[i][c // field.m, c % field.m]
        else:
            found[k, 0] = field[i]


def read_by_kernel(field):
    """What kernels read, in the shape of ``to_numpy``."""
    array = field.to_numpy()
    cells = int(np.prod(field.shape))
    found = np.zeros((cells, array.size // cells))
    read(field, found)
    return found.reshape(array.shape)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in ("matrix", "number")])
def test_a_field_has_the_numbers_that_taichis_own_would_have(store, other_store, rng, name):
    field, other = store.fields[name], other_store.fields[name]
    values = values_for(field, rng)
    for one in (field, other):
        one.from_numpy(values)
    assert field.shape == other.shape
    assert field.dtype == other.dtype
    assert field.to_numpy().dtype == other.to_numpy().dtype
    np.testing.assert_array_equal(field.to_numpy(), other.to_numpy())
    np.testing.assert_array_equal(read_by_kernel(field), values)
    np.testing.assert_array_equal(read_by_kernel(other), values)


@pytest.mark.parametrize("name", NAMES)
def test_both_sides_see_what_the_other_wrote(store, rng, name):
    owner, field = store.memory, store.fields[name]
    array = field.numbers()
    values = values_for(field, rng)
    field.from_numpy(values)
    np.testing.assert_array_equal(array, values)
    array[...] = values + 1
    np.testing.assert_array_equal(field.to_numpy(), values + 1)
    np.testing.assert_array_equal(owner.read(field), values + 1)
    increase(field)
    np.testing.assert_array_equal(array, values + 2)


@ti.kernel
def increase(field: ti.template()):
    if ti.static(len(field.shape) == 0):
        field[None] += 1
    else:
        for i in ti.grouped(field):
            field[i] += 1


def test_more_numbers_than_kernels_can_count_are_refused():
    owner, field = memory.Memory(), ti.field(float)
    with pytest.raises(tt.InputError, match="65536 x 65536 elements is too large for a kernel"):
        owner.fields.dense(ti.ij, (1 << 16, 1 << 16)).place(field)


def test_a_field_is_copied_from_another_of_any_kind(store, other_store, rng):
    field = store.fields["halves"]
    for source in (other_store.fields["halves"], Store().fields["halves"]):
        values = values_for(source, rng)
        source.from_numpy(values)
        field.copy_from(source)
        np.testing.assert_array_equal(field.to_numpy(), values)


def test_a_field_of_structs_has_a_field_for_each_member(rng):
    owner, samples = memory.Memory(), Sample.field()
    owner.fields.dense(ti.ij, (4, 3)).place(samples)
    owner.allocate()
    values = {"count": rng.integers(0, 9, (4, 3)), "colour": rng.random((4, 3, 3)).astype(np.float32)}
    samples.from_numpy(values)
    assert samples.shape == (4, 3)
    found = samples.to_numpy()
    for name, array in values.items():
        np.testing.assert_array_equal(found[name], array)
    samples[3, 2].count = 11
    samples[3, 1] = Sample(count=5, colour=tm.vec3(1, 2, 3))
    assert (samples[3, 2].count, samples[3, 1].count, samples[3, 1].colour.y) == (11, 5, 2)
    np.testing.assert_array_equal(samples.colour.to_numpy()[3, 2], values["colour"][3, 2])
    samples.fill(0)
    assert not samples.colour.to_numpy().any()


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
    assert owner.has_arrays == memory.arrays_are_possible()
    owner.write(field, np.arange(4))
    double(field)
    assert owner.read(field).tolist() == field.to_numpy().tolist() == [0, 2, 4, 6]
    assert field[3] == 6
    found = owner.read(field)
    found[:] = 0  # it is a copy
    assert field[3] == 6
