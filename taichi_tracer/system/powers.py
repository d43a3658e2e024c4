"""Powers with a whole exponent, in kernels, as products.

Without its own optimisation passes, which take half of the compilation, Taichi 1.7 ends the process when it compiles a
power of a power, such as ``(x**2)**2``. Products by repeated squaring are what those passes would make of a power.
"""

from taichi.lang import impl
from taichi.lang.common_ops import TaichiOperations

_taichi_power = TaichiOperations.__pow__


def _power(base, exponent):
    """``base ** exponent`` in a kernel."""
    if type(exponent) is not int or exponent < 1 or not impl.inside_kernel():
        return _taichi_power(base, exponent)
    square, product = impl.expr_init(base), None
    while exponent > 0:
        if exponent % 2 == 1:
            product = square if product is None else impl.expr_init(product * square)
        exponent //= 2
        if exponent > 0:
            square = impl.expr_init(square * square)
    return product


def write_as_products() -> None:
    """Let kernels compile powers with a whole exponent as products, from now on."""
    TaichiOperations.__pow__ = _power
