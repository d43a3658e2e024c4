"""What Taichi keeps of sources is what it would read again: lines, trees, and functions that share a name."""

import ast
import gc
import inspect
import linecache
import textwrap
import weakref

import numpy as np
import pytest
import taichi as ti
from hypothesis import given, settings
from hypothesis import strategies as st
from support import needs_patch
from taichi.lang import kernel_impl

from taichi_tracer.system.taichi_17 import messages, patches, sources

SHORT_AND_LONG = st.text(alphabet=st.sampled_from("ab_(-. \t\n\r\x0b\x0c\u3000"), max_size=40)


@settings(deadline=None)
@given(line=SHORT_AND_LONG, width=st.integers(1, 50), tabsize=st.sampled_from([4, 8]))
def test_lines_are_wrapped_as_by_the_standard_library(line, width, tabsize):
    assert messages.wrapped(4 * line) == textwrap.wrap(4 * line, messages.MESSAGE_WIDTH)
    assert sources.fill(line, width=width, tabsize=tabsize) == textwrap.fill(line, width=width, tabsize=tabsize)


def test_a_source_is_read_once(f32, monkeypatch):
    """A function that is called from eight places is found in its file once."""
    needs_patch("sources")
    read = []
    monkeypatch.setattr(kernel_impl, "getsourcelines", sources.kept_per_function(counting(read)))

    @ti.func
    def twice(x):
        return 2 * x

    @ti.kernel
    def eight() -> int:
        return twice(1) + twice(2) + twice(3) + twice(twice(4)) + twice(twice(twice(5)))

    assert eight() == 2 + 4 + 6 + 16 + 40
    assert read == ["eight", "twice"]


def counting(read):
    """``getsourcelines``, which notes the functions that it is asked for."""
    original = patches.originals["taichi.lang.kernel_impl:getsourcelines"]

    def getsourcelines(function):
        read.append(function.__name__)
        return original(function)

    return getsourcelines


SOURCES = {
    "usual": "def usual(a, b=1):\n    if a:\n        return b\n\n    return a\n",
    "long": "def long(\n    a,\n    b=(\n        1,\n    ),\n):\n    c = [\n        a,\n]\n    return c\n",
    "commented": "def commented(a):\n# not indented\n    while a:\n        a -= 1\n    else:\n        pass\n",
    "short": "def short(): return 1\n",
    "decorated": "@functools.lru_cache(\n    maxsize=1,\n)\ndef decorated():\n    return 1\n",
    "text": 'def text():\n    a = """\ndef of_a_text\n"""\n    return a\n',
    "dropped": 'def dropped():\n    1\n    """\ndef of_a_text\n"""\n',
    "behind": "class One:\n    def behind(self):\n        return 1\n\n\n# a heading, indented less\n\n",
    "method": "class One:\n    def method(self):\n        return 1\n\n    size = 1\n",
    "inner": "def outer():\n    def inner():\n        return 1\n    return inner\ninner = outer()\n",
    "unnamed": "unnamed = lambda: (\n    1\n)\n",
}


@pytest.mark.parametrize("name", SOURCES)
def test_the_lines_of_a_function_are_those_of_the_standard_library(name, tmp_path):
    """To the last line of code: a comment behind it may be indented less, which Taichi could not parse."""
    file = tmp_path / f"{name}.py"
    source = f"import functools\n\n{SOURCES[name]}\n\nafter = 1\n"
    file.write_text(source)
    names = {}
    exec(compile(source, str(file), "exec"), names)
    function = getattr(names["One"], name) if "One" in names else inspect.unwrap(names[name])
    lines, first = sources.source_lines(function)
    wanted, wanted_first = inspect.getsourcelines(function)
    assert (first, lines) == (wanted_first, wanted)


def test_without_a_short_way_the_usual_way_is_taken():
    """As where another version of Taichi has other members than those that are read here."""

    def fails(_):
        raise AttributeError

    assert sources.shorter(len, fails)([1, 2]) == 2


def test_a_tree_is_used_again_as_it_was():
    """Without what was written into its nodes; and never by two at the same time."""
    trees, source = sources.Trees(), "def f(a):\n    return a.b + 1\n"
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


def test_what_a_kernel_was_given_is_freed_with_its_last_name(f32):
    """Also after the first call, in which Taichi reads the kernel, and without a search for cycles of objects."""
    needs_patch("sources")

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
