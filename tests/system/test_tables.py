"""Arrays that one kernel copies into fields arrive in their rows; the other rows stay."""

import numpy as np
import pytest
import taichi as ti

from taichi_tracer.system import memory, runtime
from taichi_tracer.system.tables import Tables

ROWS = 5


@pytest.fixture(scope="module")
def fields(f32):
    """One field of each kind, in one tree."""
    store = memory.Memory()
    made = {
        "vectors": ti.Vector.field(3, float),
        "ids": ti.Vector.field(3, ti.i32),
        "numbers": ti.field(float),
        "integers": ti.field(ti.i32),
        "table": ti.field(float),
    }
    for name, field in made.items():
        (store.fields.dense(ti.ij, (ROWS, 4)) if name == "table" else store.fields.dense(ti.i, ROWS)).place(field)
    store.allocate()
    return made


@pytest.mark.parametrize("rows", [ROWS, 2, 0])
def test_every_array_arrives_in_the_first_rows(fields, rows):
    random = np.random.default_rng(rows)
    arrays = {
        "vectors": random.random((rows, 3)),
        "ids": random.integers(-9, 9, (rows, 3)),
        "numbers": random.random(rows).astype(runtime.dtype()),
        "integers": random.integers(-9, 9, rows).astype(np.int32),
        "table": random.random((rows, 4)),
    }
    tables = Tables()
    for name, array in arrays.items():
        fields[name].fill(7)
        tables.put(fields[name], array)
    tables.load()
    for name, array in arrays.items():
        found = fields[name].to_numpy()
        np.testing.assert_array_equal(found[:rows], array.astype(found.dtype))
        assert (found[rows:] == 7).all()


def test_no_array_is_no_work(f32):
    Tables().load()
