"""Values that are read and written with ``[None]``, as the fields of the course."""

import numpy as np
import taichi as ti
import taichi.math as tm
from taichi.lang import impl

from taichi_tracer.system.held import HeldExpr, held


class Owner:
    """Has a number, a whole number and a vector."""

    def __init__(self):
        self.values = {"number": 1.5, "count": 2, "vector": np.array([1.0, 2.0, 3.0])}

    def get(self, name):
        return held(self.values[name], lambda value: self.values.__setitem__(name, value))


def test_numbers_are_numbers_and_have_no_index():
    owner = Owner()
    number, count = owner.get("number"), owner.get("count")
    assert (number, number[None], count + 1, count[None]) == (1.5, 1.5, 3, 2)
    assert type(number[None]) is float
    number[None], count[None] = 4.0, 7
    assert (owner.values["number"], owner.values["count"]) == (4.0, 7)


def test_in_a_kernel_the_value_and_its_field_are_the_same(f32):
    number, vector = ti.field(float, ()), ti.Vector.field(3, float, ())
    number[None], vector[None] = 2, (1, 2, 3)

    @ti.data_oriented
    class Object:
        @property
        def number(self):
            return HeldExpr(impl.subscript(None, number, None))

        @property
        def vector(self):
            return HeldExpr(impl.subscript(None, vector, None))

        @ti.kernel
        def sums(self) -> tm.vec3:
            return tm.vec3(
                self.number + self.number[None],
                tm.dot(self.vector, self.vector[None]),
                self.vector[1] + self.vector[None][1] + self.vector.y + self.vector[None].y,
            )

    assert Object().sums().to_list() == [4, 14, 8]
