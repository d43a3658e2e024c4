"""A log of what kernels note: exact numbers in their order, limits that count what they leave out."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import start

from taichi_tracer.explain.log import Log
from taichi_tracer.ray import Ray
from taichi_tracer.system.compile_time import compile_time


@ti.data_oriented
class Noting:
    """Notes a few things in a loop."""

    def __init__(self):
        self.log = Log()

    @ti.kernel
    def run(self, n: ti.i32):
        ti.loop_config(serialize=True)
        for k in range(n):
            self.log.is_on[None] = ti.cast(k != 1, ti.i32)
            self.note(k, Ray(origin=tm.vec3(k, 0.1, -0.5), direction=tm.vec3(0, 0, 1)))

    @compile_time
    def note(self, k, ray):
        self.log.note("number", k=k, pair=(k + 1, tm.vec2(2, 3)))
        self.log.note("ray", "begin", ray=ray)
        self.log.note("often", is_limited=True, k=k)


@pytest.fixture(scope="module")
def noting():
    start("f32")
    return Noting()


def test_numbers_come_back_exact_and_in_order(noting):
    noting.log.clear()
    noting.run(3)
    found, counts = noting.log.read()
    assert [entry.name for entry, _ in found] == ["number", "ray", "often"] * 2  # nothing of k = 1
    assert [values["k"] for entry, values in found if entry.name == "number"] == [0, 2]
    _, values = found[4]
    assert values["ray.origin"].tolist() == [2, np.float64(np.float32(0.1)), -0.5]
    assert found[4][0].mark == "begin"
    assert found[3][1]["pair[0]"] == 3
    assert found[3][1]["pair[1]"].tolist() == [2, 3]
    assert counts == {"often": 2}
