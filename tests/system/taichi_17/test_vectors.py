"""Sums, products and extremes of vectors have the bits of Taichi alone; no function is read; mistakes are told."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import as_taichi_is, needs_patch, start
from taichi.lang.kernel_impl import Func

IN = ti.types.ndarray(dtype=tm.vec3, ndim=2)
DRAWN = 400


def of_a_student(pairs: IN, found: ti.types.ndarray(ndim=2)):
    for i in range(pairs.shape[0]):
        x, y = pairs[i, 0], pairs[i, 1]
        whole = ti.cast(x * 100, ti.i32)
        crossed = tm.cross(x, y) + x.cross(y)
        found[i, 0], found[i, 1], found[i, 2] = tm.dot(x, y), x.dot(y), tm.dot(x.xy, y.zx)
        found[i, 3], found[i, 4], found[i, 5] = x.sum(), (x * y).sum(), whole.sum()
        found[i, 6], found[i, 7], found[i, 8] = crossed.x, crossed.y, crossed.z
        found[i, 9], found[i, 10], found[i, 11] = x.norm(), y.norm_sqr(), tm.normalize(x).y
        found[i, 12], found[i, 13] = tm.cross(x.xy, y.xy), whole.dot(whole)
        found[i, 14] = ti.Vector([x.x, y.y, x.z, y.x, 1e8]).sum()
        found[i, 15] = ti.Matrix([[x.x, y.y], [x.z, y.x]]).sum()
        found[i, 16] = (x > y).any() + tm.distance(x, y) + tm.length(x)
        found[i, 17] = tm.dot(x + y, tm.cross(x - y, 2 * y))
        found[i, 18], found[i, 19], found[i, 20] = x.max(), (x * y).min(), whole.max() + whole.min()


def rows(kind: str) -> tuple[np.ndarray, np.ndarray]:
    dtype = {"f32": np.float32, "f64": np.float64}[kind]
    rng = np.random.default_rng(5)
    x = (rng.normal(size=(DRAWN, 2, 3)) * 10.0 ** rng.integers(-18, 18, (DRAWN, 2, 1))).astype(dtype)
    x[0], x[1, 0], x[2, 1, 1], x[3, 0, 2] = 0, np.inf, np.nan, -0.0
    return x, np.zeros((DRAWN, 21), dtype)


@pytest.mark.parametrize("kind", ["f32", "f64"])
def test_the_bits_are_those_of_taichi_alone(kind):
    start(kind)
    pairs, here = rows(kind)
    _, alone = rows(kind)
    ti.kernel(of_a_student)(pairs, here)
    with as_taichi_is():
        ti.kernel(of_a_student)(pairs, alone)
    np.testing.assert_array_equal(here, alone)


def test_no_function_is_read(monkeypatch):
    needs_patch("vectors")
    read, usual = [], Func.__call__
    monkeypatch.setattr(Func, "__call__", lambda self, *a, **k: read.append(self.func.__name__) or usual(self, *a, **k))

    @ti.kernel
    def product(x: ti.types.ndarray(ndim=1)):
        v = tm.vec3(x[0], x[1], x[2])
        x[0] = tm.dot(v, tm.cross(v, v)) + v.sum() + v.norm_sqr() + v.max() + v.min()

    product(np.ones(3, np.float32))
    assert not {"dot", "sum", "cross", "norm_sqr", "max", "min", "_reduce"} & set(read)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (lambda: tm.dot(tm.vec3(1), tm.vec2(1)), r"[Dd]imension|shape"),
        (lambda: tm.vec3(1).dot(2.0), "not a vector"),
        (lambda: tm.cross(tm.vec3(1), tm.vec2(1)), r"[Dd]imension|shape"),
    ],
)
def test_mistakes_are_told_as_by_taichi(wrong, told):
    function = ti.func(wrong)

    @ti.kernel
    def uses() -> float:
        return function()

    with pytest.raises(ti.TaichiCompilationError, match=told):
        uses()
