"""Kernels know their objects, and no other attribute takes a detour."""

import importlib
import pkgutil

import pytest
import taichi as ti
from support import needs_patch
from wings import copy_without, printed

import taichi_tracer

pytestmark = pytest.mark.usefixtures("f32")


@ti.data_oriented
class Counter:
    """A class of the package, by its module."""

    __module__ = "taichi_tracer.of_a_test"

    def __init__(self, step: int) -> None:
        self.step, self.count = step, ti.field(ti.i32, ())

    @property
    def twice(self) -> int:
        return 2 * self.step

    @ti.kernel
    def advance(self, times: ti.i32) -> ti.i32:
        self.count[None] += self.step * times
        return self.count[None]


class Backwards(Counter):
    """A student's class, which has no decorator."""

    @ti.kernel
    def go_back(self) -> ti.i32:
        self.count[None] -= self.step
        return self.count[None]


@ti.data_oriented
class Decorated(Backwards):
    """A student's class with the decorator, which replaces a kernel."""

    @ti.kernel
    def advance(self, times: ti.i32) -> ti.i32:
        return -times


class Inside(Counter):
    """A class of the package without a decorator."""

    __module__ = "taichi_tracer.of_a_test"

    @ti.kernel
    def advance(self, times: ti.i32) -> ti.i32:
        return times * 100


def test_each_object_has_its_own_kernel():
    one, ten = Counter(1), Counter(10)
    assert [one.advance(2), ten.advance(2), one.advance(1)] == [2, 20, 3]
    assert one.twice == 2
    assert one.advance.__name__ == "advance"
    assert Counter.advance._is_wrapped_kernel  # the class itself has the kernel without an object


def test_classes_of_students_inherit_and_replace_kernels():
    back = Backwards(3)
    assert [back.advance(2), back.go_back(), back.twice] == [6, 3, 6]
    decorated = Decorated(3)
    assert [decorated.advance(2), decorated.go_back(), decorated.twice] == [-2, -3, 6]
    assert Inside(3).advance(2) == 200


def test_an_unknown_attribute_is_an_error_as_everywhere():
    with pytest.raises(AttributeError, match="no attribute 'steps'"):
        Counter(1).steps  # noqa: B018 (the access is what is tested)


OF_BEFORE = """
import taichi as ti
import taichi_tracer as tt
from taichi_tracer.system.seams import assigned

class Plain(tt.{first}):
    @ti.kernel
    def asked(self) -> ti.i32:
        return self._number

@ti.data_oriented
class Decorated(Plain):
    pass

def detours():
    return ["__getattribute__" in vars(cls) for cls in (tt.{first}, Plain, Decorated)]

print(detours(), tt.MeshLightSampler.__name__)
tt.init("cpu")
print(detours(), assigned())
for cls in (Plain, Decorated):
    made = cls.__new__(cls)
    made._number = 7
    print(made.asked())
"""


@pytest.mark.parametrize("first", ["Light", "Brdf", "LampChoice", "Sampler", "Camera"])
def test_init_changes_the_classes_that_exist_already(first, tmp_path):
    """An import changes nothing; kernels of students' classes know their objects, with a decorator or without."""
    needs_patch("objects")
    told = printed(copy_without(tmp_path), OF_BEFORE.format(first=first)).splitlines()
    assert told == ["[True, False, True] MeshLightSampler", "[False, True, True] []", "7", "7"]


def test_no_class_of_the_package_takes_the_detour():
    needs_patch("objects")
    found = 0
    for module in pkgutil.walk_packages(taichi_tracer.__path__, "taichi_tracer."):
        if "assignments" in module.name or module.name.endswith("__main__"):
            continue
        try:
            names = vars(importlib.import_module(module.name))
        except ImportError:
            continue  # it needs a package that is not installed
        for value in names.values():
            if isinstance(value, type) and value.__module__ == module.name and "_data_oriented" in vars(value):
                assert "__getattribute__" not in vars(value), value
                found += 1
    assert found > 50
