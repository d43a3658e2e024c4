"""A block of its own changes what Taichi has to look through, and no value."""

import importlib
import pkgutil
import sys

import numpy as np
import taichi as ti
import taichi.math as tm
from support import needs_patch

import taichi_tracer
from taichi_tracer.system.taichi_17 import blocks


@ti.dataclass
class Pair:
    """What a function may return besides numbers, vectors and tuples."""

    first: ti.i32
    second: tm.vec3

    @ti.func
    def total(self):
        return self.first + self.second.sum()


@ti.func
def long_calculation(x):
    """Results of all kinds; without an own block, and with one (see below)."""
    y = x
    for _ in range(3):
        y = ti.sqrt(y * y * 1.25 + 0.1)
    pair = Pair(first=int(x), second=tm.vec3(x, y, 2 * x))
    return y, tm.vec2(x, y), ti.Matrix([[x, y], [y, 1.0]]), pair, ti.cast(y, ti.i32), 4


@ti.kernel
def fill(found: ti.types.ndarray(ndim=2)):
    for i in range(found.shape[0]):
        total = 0.0
        for k in range(3):
            y, v, m, pair, n, four = long_calculation(float(i + k))
            pair.first += 1
            v.y -= 0.5
            found[i, k] = v.sum() + (m @ m)[0, 1] + pair.total() + n / 2
            total += y * four
        found[i, 3] = total


def test_a_block_of_its_own_changes_no_value(f32, monkeypatch):
    """Nor the type of a result."""
    needs_patch("blocks")
    plain, in_a_block = np.zeros((64, 4), np.float32), np.zeros((64, 4), np.float32)
    ti.kernel(fill.__wrapped__)(plain)
    monkeypatch.setattr(blocks, "PACKAGE", long_calculation.__module__)
    monkeypatch.setitem(blocks.LONG, "long_calculation", 7)
    ti.kernel(fill.__wrapped__)(in_a_block)
    np.testing.assert_array_equal(plain, in_a_block)
    assert len(set(plain[:, 3])) > 3


def test_every_function_of_the_table_is_there():
    for module in pkgutil.walk_packages(taichi_tracer.__path__, "taichi_tracer."):
        if not any(word in module.name for word in ("assignments", "__main__", "apps", "cluster", "rt3", "studies")):
            importlib.import_module(module.name)
    modules = [module for name, module in sys.modules.items() if name.startswith(blocks.PACKAGE)]
    there = {cls.__name__: cls for module in modules for cls in vars(module).values() if isinstance(cls, type)}
    for name in blocks.LONG:
        cls, method = name.split(".")
        assert hasattr(there[cls], method), name


PICTURE = """
import taichi_tracer as tt
scene = tt.load_scene_data("cube", environment="studio")
tt.{renderer}(scene, 8, 8).use("{name}").render(1)
"""
MOST = 500  # own statements; where no calculation has a block of its own, there are more than 1,000
