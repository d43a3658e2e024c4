"""Python writes into the memory of fields only if it knows where that is; otherwise kernels copy, to the same end."""

import numpy as np
import taichi as ti

from taichi_tracer.system import direct, memory
from taichi_tracer.system.tables import Tables


def test_without_places_kernels_copy(f32, monkeypatch):
    memory.write_what_waits()  # what earlier tests left: the kernels below would write it
    monkeypatch.setattr(direct, "places", None)
    assert not direct.is_possible()
    owner, field, tables = memory.Memory(), ti.field(ti.i32), Tables()
    owner.fields.dense(ti.i, 3).place(field)
    owner.allocate()
    owner.write(field, np.array([1, 2, 3]))
    assert owner.read(field).tolist() == [1, 2, 3]
    tables.put(field, np.array([4, 5, 6], np.int32))
    tables.load(owner)
    assert owner.read(field).tolist() == [4, 5, 6]
