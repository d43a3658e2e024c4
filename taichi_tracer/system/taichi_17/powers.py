"""Powers of powers, such as ``(x**2)**2``, in kernels.

The package starts Taichi without Taichi's own optimisation passes, which take half of the compilation. Then Taichi 1.7
writes a power with a whole exponent as a loop, and ends the process if the base is the result of such a loop. The base
of a power therefore passes through −(−x), which has the bits of x, and of which LLVM leaves nothing. The power itself
stays Taichi's own. The package's own kernels have products instead of powers, and do not need this.
"""

import functools
from collections.abc import Callable
from typing import Any

from taichi.lang import impl


def of_a_value(usual: Callable) -> Callable:
    """``base ** exponent`` in a kernel, whose base is no result of another power."""

    @functools.wraps(usual)
    def power(base: Any, exponent: Any, modulo: Any = None) -> Any:
        if impl.inside_kernel() and not isinstance(exponent, float):
            negative = -base
            base = -negative
        return usual(base, exponent, modulo)

    return power
