"""Arrays that are copied into fields arrive in their rows; the other rows stay. Both ways do the same."""

import numpy as np
import pytest
import taichi as ti

from taichi_tracer.system import memory, runtime
from taichi_tracer.system.tables import Tables

ROWS = 5


@pytest.fixture(scope="module")
def store(f32):
    """The memory of one field of each kind, and the fields by name."""
    owner = memory.Memory()
    made = {
        "vectors": ti.Vector.field(3, float),
        "ids": ti.Vector.field(3, ti.i32),
        "numbers": ti.field(float),
        "integers": ti.field(ti.i32),
        "table": ti.field(float),
        "texels": ti.Vector.field(3, float),
        "bytes": ti.field(ti.u8),
        "matrix": ti.Matrix.field(4, 4, float),
        "pair": ti.Vector.field(2, float),
        "one": ti.field(ti.i32),
    }
    for name, field in made.items():
        if name in ("table", "texels", "bytes"):
            owner.fields.dense(ti.ij, (ROWS, 4)).place(field)
        elif name in ("matrix", "pair", "one"):
            owner.fields.place(field)
        else:
            owner.fields.dense(ti.i, ROWS).place(field)
    owner.allocate()
    return owner, made


def loaded(owner, some, by_kernel):
    """Copy by one of the two ways."""
    if by_kernel:
        some.load_by_kernel()
    else:
        some.load(owner)


@pytest.mark.parametrize("by_kernel", [False, True])
@pytest.mark.parametrize("rows", [ROWS, 2, 0])
def test_every_array_arrives_in_the_first_rows(store, rng, rows, by_kernel):
    owner, fields = store
    arrays = {
        "vectors": rng.random((rows, 3)),
        "ids": rng.integers(-9, 9, (rows, 3)),
        "numbers": rng.random(rows).astype(runtime.dtype()),
        "integers": rng.integers(-9, 9, rows).astype(np.int32),
        "table": rng.random((rows, 4)),
        "texels": rng.random((rows, 4, 3)),
        "bytes": rng.integers(0, 255, (rows, 4)).astype(np.uint8),
    }
    some = Tables()
    for name, array in arrays.items():
        owner.write(fields[name], np.full_like(owner.read(fields[name]), 7))
        some.put(fields[name], array)
    loaded(owner, some, by_kernel)
    for name, array in arrays.items():
        found = fields[name].to_numpy()
        np.testing.assert_array_equal(found[:rows], array.astype(found.dtype))
        assert (found[rows:] == 7).all()


@pytest.mark.parametrize("by_kernel", [False, True])
def test_numbers_of_f64_keep_every_bit(f32, rng, by_kernel):
    if not runtime.has_f64():
        pytest.skip("this backend has no f64")
    owner = memory.Memory()
    rows, one = ti.Vector.field(4, ti.f64), ti.field(ti.f64)
    owner.fields.dense(ti.i, 3).dense(ti.j, 3).place(rows)
    owner.fields.dense(ti.i, 2).place(one)
    owner.allocate()
    some, arrays = Tables(), (rng.normal(size=(3, 3, 4)), np.array([1e300, -(2.0**-1074)]))
    for field, array in zip((rows, one), arrays, strict=True):
        some.put(field, array)
    loaded(owner, some, by_kernel)
    for field, array in zip((rows, one), arrays, strict=True):
        np.testing.assert_array_equal(field.to_numpy(), array)
    owner.free()
