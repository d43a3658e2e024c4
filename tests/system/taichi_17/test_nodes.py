"""Numbers, operators and their errors are those of Taichi alone."""

import numpy as np
import pytest
import taichi as ti
from support import as_taichi_is, start

VALUE = {
    "operators": "(a + 5 - 3 * a / 2) + (a // 3) + (a % 3) + a**2 + (a << 2) + (a >> 1) + (a | 8) + (a ^ 5) + (a & 3)",
    "matrices": "(ti.Matrix([[1, 2], [3, a]]) @ ti.Vector([a, 2]))[1]",
    "of Python": "max(a, 3) + min(a, 3) + abs(-a) + int(2.7) + pow(a, 2) + len(ti.Vector([1, 2, a])) + float(a)",
    "any and all": "int(any(ti.Vector([a, 0])) == 1) + int(all(ti.Vector([a, 0])) == 1)",
    "the largest number": "a + 2147483647",
    "the smallest number": "a + (-2147483647 - 1)",
    "too large a number": "a + 2147483648",
    "a fraction": "a * 0.1",
    "a truth": "a + True",
    "numbers of numpy": "a + THREE * HALF + QUARTER",
    "a number with a type": "a + ti.u8(200) + ti.f64(0.1) + ti.i64(1 << 40) % 1000",
    "no number": "a + 'text'",
    "no operation": "a @ 2",
    "shapes": "(ti.Vector([a, 1]) + ti.Vector([a, 1, 2]))[0]",
}


@pytest.mark.parametrize("name", VALUE)
def test_numbers_and_operators_are_those_of_taichi_alone(name, tmp_path):
    """The same value, or the same message, as where Taichi reads operators, numbers and Python's functions."""
    start("f32")
    file = tmp_path / "value.py"
    file.write_text(f"import taichi as ti\n\n\ndef value(a: int) -> float:\n    return {VALUE[name]}\n")
    module = {"__name__": "value", "THREE": np.int32(3), "HALF": np.float32(0.5), "QUARTER": np.float64(0.25)}
    exec(compile(file.read_text(), str(file), "exec"), module)

    def asked() -> str:
        try:
            return repr(ti.kernel(module["value"])(7))
        except ti.TaichiCompilationError as error:
            return f"{type(error).__name__}: {error}"

    kept = asked()
    with as_taichi_is():
        alone = asked()
    assert kept == alone
    assert kept.startswith("Taichi") == (name in ("too large a number", *list(VALUE)[-3:]))
