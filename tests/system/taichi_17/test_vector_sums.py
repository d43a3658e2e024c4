"""Vectors of kernels are summed up as Taichi's own functions do it: the same operations, and the same errors."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import start

from taichi_tracer.system.taichi_17 import patches, vector_sums

ROWS = 64
ARRAY = ti.types.ndarray(ndim=2)


@ti.kernel
def found(a: ARRAY, b: ARRAY, out: ARRAY):
    for i in range(a.shape[0]):
        x, y = tm.vec3(a[i, 0], a[i, 1], a[i, 2]), tm.vec3(b[i, 0], b[i, 1], b[i, 2])
        c = tm.cross(x, y)
        n = x.normalized()
        numbers = ti.Vector([tm.dot(x, y), x.dot(y), x.sum(), x.norm(), x.norm_sqr(), c.x, c.y, c.z, n.x, n.y, n.z])
        for k in ti.static(range(11)):
            out[i, k] = numbers[k]


def in_numpy(a, b):
    """The same, with every operation rounded."""

    def total(v):
        return (v[:, 0] + v[:, 1]) + v[:, 2]

    norm = np.sqrt(total(a * a))
    cross = np.stack([a[:, j] * b[:, k] - a[:, k] * b[:, j] for j, k in ((1, 2), (2, 0), (0, 1))], axis=1)
    inverse = (1 / norm).astype(a.dtype)
    sums = [total(a * b), total(a * b), total(a), norm, total(a * a)]
    return np.column_stack([*sums, cross, inverse[:, None] * a])


def test_every_operation_is_rounded_as_it_is_written():
    start("f32")
    random = np.random.default_rng(1)
    a, b = (random.normal(size=(ROWS, 3)).astype(np.float32) for _ in range(2))
    out = np.zeros((ROWS, 11), np.float32)
    found(a, b, out)
    np.testing.assert_array_equal(out, in_numpy(a, b))


def test_other_sizes_and_python_have_taichis_own():
    start("f32")

    @ti.kernel
    def in_plane() -> float:
        v = tm.vec2(3, 4)
        return v.norm() + tm.cross(v, tm.vec2(1, 2)) + ti.Matrix([[1.0, 2.0], [3.0, 4.0]]).sum()

    assert in_plane() == 5 + 2 + 10
    assert ti.Vector([3.0, 4.0]).norm() == 5
    assert ti.Vector([1.0, 2.0, 3.0]).dot(ti.Vector([1.0, 1.0, 1.0])) == 6


def test_wrong_vectors_have_taichis_own_message():
    start("f32")

    @ti.kernel
    def wrong() -> float:
        return tm.dot(tm.vec3(1), 2.0)

    with pytest.raises(ti.TaichiCompilationError, match="non-tensor"):
        wrong()


def test_an_argument_is_computed_once():
    start("f32")
    count = ti.field(ti.i32, ())

    @ti.func
    def counted():
        count[None] += 1
        return tm.vec3(1, 2, 2)

    @ti.kernel
    def lengths() -> float:
        return counted().norm() + tm.dot(counted(), tm.vec3(1)) + tm.cross(counted(), tm.vec3(1)).sum()

    assert lengths() == 3 + 5
    assert count[None] == 3


def test_every_function_that_is_replaced_is_there():
    (patch,) = [patch for patch in patches.PATCHES if patch.name == "vectors"]
    assert {name.rpartition(":")[2] for name in patch.replaces} == set(vector_sums.DIRECT)
