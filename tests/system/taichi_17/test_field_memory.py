"""The memory of a field as an array: what one side writes, the other reads, whatever the place of the field is."""

import numpy as np
import pytest
import taichi as ti
from support import needs_patch

from taichi_tracer.system import memory
from taichi_tracer.system.taichi_17 import field_memory


@pytest.fixture(scope="module")
def store(f32):
    """The memory of fields of all kinds that the package has, and the fields by name."""
    needs_patch("memory")
    owner = memory.Memory()
    made = {
        "matrix": ti.Matrix.field(4, 4, float),
        "number": ti.field(ti.i32),
        "table": ti.field(float),
        "vectors": ti.Vector.field(3, float),
        "ids": ti.Vector.field(3, ti.i32),
        "bytes": ti.Vector.field(8, ti.u8),
        "children": ti.field(ti.i32),
        "halves": ti.Vector.field(3, float),
        "half_counts": ti.field(ti.i32),
    }
    owner.fields.dense(ti.ij, (5, 4)).place(made["table"])
    owner.fields.dense(ti.i, 7).place(made["ids"], made["vectors"])
    node = owner.fields.dense(ti.i, 6)
    node.dense(ti.j, 6).place(made["bytes"])
    node.dense(ti.j, 8).place(made["children"])
    owner.fields.dense(ti.k, 2).dense(ti.ij, (5, 3)).place(made["half_counts"], made["halves"])
    owner.fields.place(made["number"], made["matrix"])
    owner.allocate()
    return owner, made


NAMES = ["matrix", "number", "table", "vectors", "ids", "bytes", "children", "halves", "half_counts"]


@pytest.mark.parametrize("name", NAMES)
def test_both_sides_see_what_the_other_wrote(store, rng, name):
    owner, made = store
    array, field = owner.array(made[name]), made[name]
    values = rng.integers(0, 200, array.shape).astype(array.dtype)
    field.from_numpy(values)
    np.testing.assert_array_equal(array, values)
    array[...] = values + 1
    np.testing.assert_array_equal(field.to_numpy(), values + 1)


def test_a_whole_block_is_cleared_and_nothing_else(store):
    owner, made = store
    for field in made.values():
        owner.write(field, np.ones_like(owner.read(field)))
    owner.clear(made["ids"])
    owner.clear(made["halves"])
    cleared = {name for name, field in made.items() if not owner.read(field).any()}
    assert cleared == {"ids", "vectors", "halves", "half_counts"}
    assert all(owner.read(field).all() for name, field in made.items() if name not in cleared)


def test_fields_in_blocks_are_refused(store):
    owner, blocked = memory.Memory(), ti.field(float)
    owner.fields.dense(ti.i, 4).dense(ti.i, 2).place(blocked)
    owner.allocate()
    with pytest.raises(ValueError, match="divided into blocks"):
        owner.array(blocked)


def test_one_kernel_finds_all_fields_of_a_memory(store, monkeypatch):
    owner, made = store
    owner.array(made["table"])
    monkeypatch.setattr(field_memory, "root_addresses", lambda fields: pytest.fail("the address is known"))
    owner.array(made["halves"])


def test_many_places_are_told_by_several_kernels(store, recwarn):
    owners = [memory.Memory() for _ in range(2 * field_memory.AT_ONCE + 1)]
    fields = [ti.field(ti.i32) for _ in owners]
    for owner, field in zip(owners, fields, strict=True):
        owner.fields.dense(ti.i, 3).place(field)
        owner.allocate()
    for k, (owner, field) in enumerate(zip(owners, fields, strict=True)):
        owner.write(field, np.full(3, k))
    assert [field[2] for field in fields] == list(range(len(owners)))
    assert not recwarn.list
