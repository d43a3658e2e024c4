"""``taichi.math``, with functions of vectors that Python reads in a fraction of the time.

``taichi.math.dot`` calls three functions of Taichi, each in the other, and Python reads their sources anew at each dot
product of a kernel. Those below give the same numbers, and leave less in the kernel to translate.
"""

import taichi as ti
from taichi.math import asin, clamp, degrees, inf, mat3, pi, popcnt, pow, sign, sqrt, vec2, vec3, vec4  # noqa: F401

from taichi_tracer.system.compile_time import compile_time, element, variable


@compile_time
def component_sum(v):
    """The sum of the numbers of a vector."""
    first, *others = components(v)
    return variable(sum(others, first))


@compile_time
def component_max(v):
    """The largest number of a vector."""
    return variable(ti.max(*components(v)))


@compile_time
def dot(a, b):
    """The dot product of two vectors."""
    return component_sum(a * b)


@compile_time
def length(v):
    """The length of a vector."""
    v = variable(v)
    return variable(ti.sqrt(dot(v, v)))


@compile_time
def normalize(v):
    """The unit vector in the direction of a vector."""
    v = variable(v)
    return variable(v / length(v))


@compile_time
def cross(a, b):
    """The cross product of two vectors of three numbers."""
    (a0, a1, a2), (b0, b1, b2) = components(a), components(b)
    found = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    return type(a)(*found) if hasattr(a, "components") else variable(ti.Vector(found))


def components(v):
    """The numbers of a vector, which is computed once; or the parts of what ``intersectors.lanes`` calls a vector."""
    if hasattr(v, "components"):
        return v.components
    v = variable(v)
    return [element(v, k) for k in range(v.get_shape()[0])]
