"""Values that are read and written with ``[None]``, as the fields of the course."""

import copy
import pickle

import numpy as np
import pytest
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


def test_vectors_are_arrays_and_vectors_of_taichi(f32):
    owner = Owner()
    vector = owner.get("vector")
    assert (vector + 1).tolist() == [2, 3, 4]
    assert (vector[None] + 2 * vector[None]).to_list() == [3, 6, 9]
    assert vector[None].y == vector[1] == 2
    vector[None] = tm.vec3(4, 5, 6)
    assert list(owner.values["vector"]) == [4, 5, 6]


def test_a_part_of_a_vector_is_a_copy():
    vector = Owner().get("vector")
    vector[0] = 9
    assert vector.tolist() == [9, 2, 3]


def test_a_copy_of_a_number_is_a_plain_number():
    """A pickled one, too: what it belongs to is not copied with it."""
    owner = Owner()
    for name in ("number", "count"):
        for made in (copy.deepcopy(owner.get(name)), pickle.loads(pickle.dumps(owner.get(name)))):
            assert (type(made), made) == (type(owner.values[name]), owner.values[name])
    assert pickle.loads(pickle.dumps(owner.get("vector"))).tolist() == [1, 2, 3]


def test_numbers_have_no_other_index():
    with pytest.raises(TypeError, match="assign all numbers at once"):
        Owner().get("number")[0] = 1


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
