"""Sums and products that are rounded before anything else happens to them, on every backend.

Compilers for graphics cards join a product and the addition that follows it into one operation, which rounds once (a
fused multiply–add). Taichi's compiler for CUDA does so without ``fast_math``, too, and so do drivers of Vulkan. Then
a b − c d is no longer exactly −(c d − a b), and a ray passes between two triangles that share an edge. Drivers of
Vulkan also shorten (a + b) − a to b, and the film no longer knows what its additions lost.
"""

import numpy as np
import taichi as ti

from taichi_tracer.system import runtime
from taichi_tracer.system.compile_time import compile_time, variable


@compile_time
def rounded(number):
    """A sum or product, rounded before anything else happens to it; on a CPU, that is the number itself.

    Elsewhere it goes a way through its bits that no compiler shortens: n (n + 1) is even for every n.
    """
    if runtime.can("separate roundings"):
        return number
    bits = variable(ti.bit_cast(number, ti.i64 if runtime.dtype() is np.float64 else ti.i32))
    low = variable(bits & 0x7FFF)  # so few bits that the product with the next number does not overflow
    return ti.bit_cast(bits ^ (low * (low + 1) & 1), float)
