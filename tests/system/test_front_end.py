"""What Taichi keeps of sources is what it would read again: lines, messages, and functions that share a name."""

import ast
import gc
import inspect
import linecache
import sys
import textwrap
import weakref

import numpy as np
import pytest
import taichi as ti
from hypothesis import given, settings
from hypothesis import strategies as st
from support import start
from taichi._lib import core
from taichi.lang import expr, kernel_impl, util
from taichi.lang.ast import ast_transformer, ast_transformer_utils

from taichi_tracer.system import front_end

SHORT_AND_LONG = st.text(alphabet=st.sampled_from("ab_(-. \t\n\r\x0b\x0c\u3000"), max_size=40)


@settings(deadline=None)
@given(line=SHORT_AND_LONG, width=st.integers(1, 50), tabsize=st.sampled_from([4, 8]))
def test_lines_are_wrapped_as_by_the_standard_library(line, width, tabsize):
    assert front_end.wrapped(4 * line) == textwrap.wrap(4 * line, front_end.MESSAGE_WIDTH)
    assert front_end.fill(line, width=width, tabsize=tabsize) == textwrap.fill(line, width=width, tabsize=tabsize)


def test_the_class_of_a_function_is_found_as_by_the_standard_library(f32):
    """Taichi asks for the line at which the frame of the class's module stands: it must be the same line."""
    front_end.find_classes_quickly()
    assert kernel_impl.inspect.getframeinfo is front_end.frame_info
    frame = sys._getframe()
    assert front_end.frame_info(frame)[:2] == inspect.getframeinfo(frame)[:2]  # both are called on one line
    code = "class Example:\n    frame = sys._getframe(1)\n"  # no file: Taichi then takes it for no class
    names = {"sys": sys}
    exec(compile(code, "<nowhere>", "exec"), names)
    assert front_end.frame_info(names["Example"].frame).code_context == [""]

    @ti.data_oriented
    class Doubling:
        @ti.func
        def of(self, x):
            return 2 * x

        @ti.kernel
        def run(self) -> int:
            return self.of(21)

    assert Doubling().run() == 42


def test_a_source_is_read_once(f32, monkeypatch):
    """A function that is called from eight places is found in its file once."""
    read = []
    monkeypatch.setattr(kernel_impl, "getsourcelines", front_end.kept_per_function(counting(read)))

    @ti.func
    def twice(x):
        return 2 * x

    @ti.kernel
    def eight() -> int:
        return twice(1) + twice(2) + twice(3) + twice(twice(4)) + twice(twice(twice(5)))

    assert eight() == 2 + 4 + 6 + 16 + 40
    assert read == ["eight", "twice"]


SOURCES = {
    "usual": "def usual(a, b=1):\n    if a:\n        return b\n\n    return a\n",
    "long": "def long(\n    a,\n    b=(\n        1,\n    ),\n):\n    c = [\n        a,\n]\n    return c\n",
    "commented": "def commented(a):\n# not indented\n    while a:\n        a -= 1\n    else:\n        pass\n",
    "short": "def short(): return 1\n",
    "decorated": "@functools.lru_cache(\n    maxsize=1,\n)\ndef decorated():\n    return 1\n",
    "text": 'def text():\n    a = """\ndef of_a_text\n"""\n    return a\n',
    "dropped": 'def dropped():\n    1\n    """\ndef of_a_text\n"""\n',
    "method": "class One:\n    def method(self):\n        return 1\n\n    size = 1\n",
    "inner": "def outer():\n    def inner():\n        return 1\n    return inner\ninner = outer()\n",
    "unnamed": "unnamed = lambda: (\n    1\n)\n",
}


@pytest.mark.parametrize("name", SOURCES)
def test_the_lines_of_a_function_are_those_of_the_standard_library(name, tmp_path):
    """As far as they are code: comments and empty lines at the end may follow."""
    file = tmp_path / f"{name}.py"
    source = f"import functools\n\n{SOURCES[name]}\n\nafter = 1\n"
    file.write_text(source)
    names = {}
    exec(compile(source, str(file), "exec"), names)
    function = names["One"].method if name == "method" else inspect.unwrap(names[name])
    lines, first = front_end.source_lines(function)
    wanted, wanted_first = inspect.getsourcelines(function)
    assert (first, lines[: len(wanted)]) == (wanted_first, wanted)
    assert all(not line.strip() for line in lines[len(wanted) :])


def test_without_a_short_way_the_usual_way_is_taken():
    """As where another version of Taichi has other members than those that are read here."""

    def fails(_):
        raise AttributeError

    assert front_end.shorter(len, fails)([1, 2]) == 2


def test_a_tree_is_used_again_as_it_was():
    """Without what was written into its nodes; and never by two at the same time."""
    trees, source = front_end.Trees(), "def f(a):\n    return a.b + 1\n"
    tree = trees.parse(source)
    other = trees.parse(source)
    assert other is not tree
    function = tree.body[0]
    function.args.args, function.body[0].value.left.caller = [], "written by Taichi"
    for node in ast.walk(tree):
        if isinstance(node, (ast.stmt, ast.expr)):
            node.ptr = "written by Taichi"
    trees.give_back(tree)
    again = trees.parse(source)
    assert again is tree
    assert ast.dump(again) == ast.dump(ast.parse(source))
    function.decorator_list = ["exchanged by Taichi"]
    trees.give_back(again)
    again = trees.parse(source)
    assert again is tree
    assert ast.dump(again) == ast.dump(ast.parse(source))
    written = {"ptr", "caller"}
    assert not any(written & set(vars(node)) for node in ast.walk(again))


def test_a_function_that_calls_itself_while_it_is_read(f32):
    @ti.func
    def power(x, n: ti.template()):
        result = x
        if ti.static(n > 1):
            result = x + (power(x + 1, n - 1) + x)
        return result

    @ti.kernel
    def both(x: int) -> int:
        return 100 * power(x, 3) + power(x, 2)

    def expected(x, n):
        return x if n == 1 else x + expected(x + 1, n - 1) + x

    assert both(1) == 100 * expected(1, 3) + expected(1, 2)
    assert both(2) == 100 * expected(2, 3) + expected(2, 2)


def test_cycles_of_objects_are_looked_for_again_after_a_kernel_was_read(f32):
    @ti.kernel
    def right() -> int:
        return 1

    @ti.kernel
    def wrong() -> int:
        return not_defined_anywhere  # noqa: F821

    assert right() == 1
    assert gc.isenabled()
    with pytest.raises(ti.TaichiNameError):
        wrong()
    assert gc.isenabled()


def test_what_a_kernel_was_given_is_freed_with_its_last_name(f32):
    """Also after the first call, in which Taichi reads the kernel, and without a search for cycles of objects."""

    @ti.func
    def twice(values: ti.template(), i):
        return 2 * values[i]

    @ti.kernel
    def first(values: ti.types.ndarray(dtype=ti.i32, ndim=1)) -> ti.i32:
        return twice(values, 0)

    values = np.array([21], np.int32)
    kept = weakref.ref(values)
    gc.disable()
    try:
        assert first(values) == 42
        del values
        assert kept() is None
    finally:
        gc.enable()


def test_the_place_of_a_field_is_told_as_by_taichi():
    def both(level):
        return util.get_traceback(level), front_end.traceback_text(level)

    for level in (1, 2):
        usual, found = both(level)
        assert found == usual


def counting(read):
    """``getsourcelines``, which notes the functions that it is asked for."""
    original = kernel_impl.getsourcelines.__wrapped__

    def getsourcelines(function):
        read.append(function.__name__)
        return original(function)

    return getsourcelines


def test_functions_of_one_name_are_not_confused(f32):
    def made(number):
        @ti.func
        def value():
            return number

        return value

    one, two = made(1), made(2)

    @ti.kernel
    def both() -> int:
        return 10 * one() + two()

    assert both() == 12


def test_a_function_that_is_defined_again_is_read_again(f32, tmp_path):
    """As in a notebook's cell that is run a second time: the same file, name and line."""
    found = []
    for number in (1, 2):
        file = tmp_path / "cell.py"
        source = f"import taichi as ti\n@ti.func\ndef value():\n    return {number}\n"
        file.write_text(source)
        linecache.checkcache(str(file))
        cell = {"__name__": "cell"}
        exec(compile(source, str(file), "exec"), cell)
        value = cell["value"]

        @ti.kernel
        def asked() -> int:
            return value()  # noqa: B023 (called in this turn of the loop)

        found.append(asked())
    assert found == [1, 2]


@ti.func
def wrong_in_the_second_line(a):
    b = a + 1
    return b + not_defined_anywhere + "a very long text, so that the line is longer than eighty characters"  # noqa: F821


@ti.kernel
def asks_it() -> int:
    return wrong_in_the_second_line(1)


def test_messages_are_those_of_taichi_alone():
    """Word for word what Taichi prints when it reads and describes everything anew."""
    start("f32")
    with pytest.raises(ti.TaichiNameError) as kept:
        asks_it()
    context = ast_transformer_utils.ASTTransformerContext
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(context, "get_pos_info", context.get_pos_info.__wrapped__)
        patch.setattr(kernel_impl, "textwrap", textwrap)
        for name in ("getsourcefile", "getsourcelines"):
            patch.setattr(kernel_impl, name, getattr(kernel_impl, name).__wrapped__)
        with pytest.raises(ti.TaichiNameError) as alone:
            asks_it()
    assert str(kept.value) == str(alone.value)
    assert "test_front_end.py" in str(kept.value)
    assert "^^^^^^^^^^^^^^^^^^^^" in str(kept.value)


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
    transformer = ast_transformer.ASTTransformer
    with pytest.MonkeyPatch.context() as patch:
        for method in ("build_BinOp", "build_call_if_is_builtin"):
            patch.setattr(transformer, method, staticmethod(getattr(transformer, method).__wrapped__))
        patch.setattr(ast_transformer_utils.Builder, "__call__", ast_transformer_utils.Builder.__call__.__wrapped__)
        patch.setattr(expr.Expr, "__init__", expr.Expr.__init__.__wrapped__)
        patch.setattr(expr, "make_constant_expr", expr.make_constant_expr.__wrapped__)
        patch.setattr(core, "DebugInfo", core.DebugInfo.__wrapped__)
        alone = asked()
    assert kept == alone
    assert kept.startswith("Taichi") == (name in ("too large a number", *list(VALUE)[-3:]))
