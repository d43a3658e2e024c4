"""Taichi's front end without the work that it repeats: the same kernels in less than half of its time.

Wherever a kernel calls a function, Taichi 1.7 finds and reads that function's source again, and for each expression it
writes out the source lines that an error message would show. Together they take more than half of the time in which
Python reads kernels. What is read and written is the same each time, so that it is kept here, and it is found by
shorter ways. Kernels do not change. Neither do messages, except that an error that Python raises while it reads a
kernel shows other lines of Taichi's own files. What a kernel was given in its first call is not kept.

For each function with ``@ti.func``, Taichi looks for the line of its class, and searches all modules for the file that
it already knows. ``frame_info`` reads the line from this file, which makes the imports of this package shorter by a
third.
"""

import ast
import functools
import gc
import inspect
import linecache
import operator
import sys
import textwrap
import types
import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
import taichi as ti
from taichi._lib import core
from taichi.lang import expr, impl, kernel_impl, matrix, snode, util
from taichi.lang.ast import ast_transformer, ast_transformer_utils

from taichi_tracer.system.importing import frame_info

MESSAGE_WIDTH = 80  # characters: where Taichi breaks the source lines of its messages
KEPT_LINES = 1 << 14  # source lines whose wrapped form is kept
KEPT_PLACES = 1 << 13  # places for messages that are kept
LONG_TEXT = 2000  # characters of a place from which on it is not kept
SMALL = 1 << 31  # integers from −SMALL on, below SMALL, have 32 bits
OPENS_NO_BLOCK = ("#", ")", "]", "}")  # begins of lines that end no function, although they are not indented


def is_short(line: str, width: int) -> bool:
    """Whether a line is wrapped by cutting off its last spaces: it fits, and has no other white space."""
    return len(line) <= width and line.isascii() and line.isprintable()


@functools.lru_cache(KEPT_LINES)
def fill(line: str, width: int = 70, **options: Any) -> str:
    """``textwrap.fill``."""
    text = line.removesuffix("\n")
    return text.rstrip(" ") if is_short(text, width) else textwrap.fill(line, width, **options)


@functools.lru_cache(KEPT_LINES)
def wrapped(line: str) -> list[str]:
    """``textwrap.wrap``, for a source line in a message."""
    if not is_short(line, MESSAGE_WIDTH):
        return textwrap.wrap(line, MESSAGE_WIDTH)
    line = line.rstrip(" ")
    return [line] if line else []


def marked(line: str, first: int, last: int) -> str:
    """A source line, and below it a line that marks the columns from ``first`` to before ``last`` (Taichi's form).

    Both are wrapped as texts, each by itself, so that the marks of a line that is too long are in unexpected places.
    """
    code = wrapped(line)
    if not code:
        return "\n\n"
    if first < last <= MESSAGE_WIDTH and len(line) <= MESSAGE_WIDTH:  # the marks are not wrapped
        return f"{code[0]}\n{' ' * first}{'^' * (last - first)}\n"
    marks = wrapped(" " * first + "^" * (last - first) + " " * (len(line) - max(first, last)))
    return "".join([f"{text}\n{mark}\n" for text, mark in zip(code, marks, strict=False)])


def position(self: Any, node: ast.stmt | ast.expr) -> str:
    """``ASTTransformerContext.get_pos_info``: the source lines of a node, as messages show them."""
    text = f'File "{self.file}", line {node.lineno + self.lineno_offset}, in {self.func.func.__name__}:\n'
    begin, end = self.indent + node.col_offset, self.indent + (node.end_col_offset or 0)
    if node.lineno == node.end_lineno:
        return text + marked(self.src[node.lineno - 1], begin, end)
    last_line = node.end_lineno or node.lineno
    if isinstance(node, (ast.For, ast.While, ast.FunctionDef, ast.If)):
        last_line = max(node.body[0].lineno - 1, node.lineno)
    for number in range(node.lineno, last_line + 1):
        line = self.src[number - 1]
        code = line.strip()
        first = begin if number == node.lineno else line.index(code)
        last = end if number == node.end_lineno and number != node.lineno else line.index(code) + len(code)
        text += marked(line, first, last)
    return text


def source_lines(function: Callable) -> tuple[list[str], int]:
    """``inspect.getsourcelines`` of a function, without reading its tokens.

    The function ends before the first line that is indented as little as its own. If the compiler has seen a later
    line, or if a text of several lines does not end there, ``inspect`` reads the tokens.
    """
    code = getattr(function, "__code__", None)
    if code is None or hasattr(function, "__wrapped__") or not hasattr(code, "co_positions"):
        return inspect.getsourcelines(function)
    linecache.checkcache(code.co_filename)
    lines, first = linecache.getlines(code.co_filename, function.__globals__), code.co_firstlineno
    end = end_of_block(lines, first - 1)
    seen = max((last for _, last, _, _ in code.co_positions() if last is not None), default=first)
    found = lines[first - 1 : end]
    has_whole_texts = all("".join(found).count(quotes) % 2 == 0 for quotes in ('"""', "'''"))
    return (found, first) if seen <= end and has_whole_texts else inspect.getsourcelines(function)


def end_of_block(lines: list[str], first: int) -> int:
    """The index after the last line of the function, or of its decorators, that begins at an index; 0 if none does."""
    if first >= len(lines):
        return 0
    indent = indentation(lines[first])
    begun = False
    for i in range(first, len(lines)):
        line = lines[i].lstrip()
        if line and not line.startswith(OPENS_NO_BLOCK):
            is_inside = indentation(lines[i]) > indent
            if begun and not is_inside:
                return i
            begun = begun or line.startswith("def ")
    return len(lines) if begun else 0


def indentation(line: str) -> int:
    """The number of characters before the first that is no space."""
    return len(line) - len(line.lstrip())


@functools.lru_cache(KEPT_LINES)
def described_frame(file: str, number: int, function: str) -> str:
    """A line of code and its place, as ``traceback`` writes them."""
    line = linecache.getline(file, number).strip()
    return f'  File "{file}", line {number}, in {function}\n' + (f"    {line}\n" if line else "")


def traceback_text(stacklevel: int = 1) -> str:
    """``taichi.lang.util.get_traceback``: the callers of a function, the outermost first, without the last ones.

    Taichi writes them for every field, because a message about a field would tell where it was made.
    """
    frame: types.FrameType | None = sys._getframe(1 + stacklevel)
    texts = []
    while frame is not None:
        texts.append(described_frame(frame.f_code.co_filename, frame.f_lineno, frame.f_code.co_name))
        frame = frame.f_back
    return "".join(reversed(texts))


def shorter(usual: Callable, way: Callable) -> Callable:
    """``way``, which does the same as ``usual`` in less time; where it fails, ``usual``."""

    @functools.wraps(usual)
    def found(*words):
        try:
            return way(*words)
        except Exception:
            return usual(*words)

    return found


def kept_per_function(find):
    """``find(function)``, found once for each function."""
    kept = weakref.WeakKeyDictionary()

    @functools.wraps(find)
    def found(function):
        if function not in kept:
            kept[function] = find(function)
        return kept[function]

    return found


def kept_per_node(describe):
    """``describe(self, node)``, written once for each node of a function's syntax tree.

    A call of a function has a context of its own, in which the descriptions of the function are kept as well.
    """
    kept = weakref.WeakKeyDictionary()

    @functools.wraps(describe)
    def described(self, node):
        descriptions = self.__dict__.get("descriptions")
        if descriptions is None:
            descriptions = self.descriptions = kept.setdefault(self.func.func, {})
        found = descriptions.get(node)
        if found is None:
            found = descriptions[node] = describe(self, node)
        return found

    return described


class Trees:
    """Syntax trees of sources, which are used again and again.

    Taichi writes into the nodes what it has built from them. Therefore a tree is given back after its use, as it was
    before. Meanwhile, another tree of the same source is made, as for a function that calls itself at compile time.
    """

    def __init__(self) -> None:
        self._free: dict[str, list[ast.AST]] = {}

    def parse(self, source: str) -> ast.AST:
        """The syntax tree of a source, as ``ast.parse`` makes it."""
        free = self._free.setdefault(source, [])
        if free:
            return free.pop()
        tree: Any = ast.parse(source)
        nodes = [node for node in ast.walk(tree) if vars(node)]  # all trees share those without members, as ast.Add()
        tree.source_of_tree = source
        exchanged = ast.FunctionDef, ast.arguments
        tree.parts_of_functions = [(node, dict(vars(node))) for node in nodes if isinstance(node, exchanged)]
        tree.members_of_nodes = None  # so that this member is counted, too
        tree.members_of_nodes = [(vars(node), len(vars(node))) for node in nodes]
        return tree

    def give_back(self, tree: Any) -> None:
        """Let a tree be used again. Taichi adds members to nodes, and exchanges some members of functions."""
        source = getattr(tree, "source_of_tree", None)
        if source is None:
            return
        for members, count in tree.members_of_nodes:
            while len(members) > count:
                members.popitem()  # the member that was added last
        for node, own in tree.parts_of_functions:
            vars(node).update(own)
        self._free[source].append(tree)


def letting_go(transform: Callable, trees: Trees) -> Callable:
    """``transform_tree``, after which its tree can be used again, and the context has no arguments.

    A context belongs to a cycle of objects, which Python finds only when it looks for such cycles. The arrays and the
    scene of a kernel's first call would stay in memory until then.
    """

    @functools.wraps(transform)
    def transformed(tree: ast.AST, context: Any) -> Any:
        try:
            return transform(tree, context)
        finally:
            context.argument_data = ()
            trees.give_back(tree)

    return transformed


def without_collections(create: Callable) -> Callable:
    """``Program.create_kernel``, which reads a kernel, while Python does not look for cycles of objects.

    Nearly all of the many objects that are made while a kernel is read stay: the search would find nothing.
    """

    @functools.wraps(create)
    def created(*words: Any) -> Any:
        was_enabled = gc.isenabled()
        gc.disable()
        try:
            return create(*words)
        finally:
            if was_enabled:
                gc.enable()

    return created


def with_short_way(usual: Callable) -> Callable:
    """``Expr.__init__``, with a shorter way for what most expressions are made from."""

    @functools.wraps(usual)
    def made(self: Any, *words: Any, dbg_info: Any = None, dtype: Any = None) -> None:
        if len(words) != 1 or type(words[0]) is not core.Expr:
            usual(self, *words, dbg_info=dbg_info, dtype=dtype)
            return
        self.ptr, self.dbg_info = words[0], dbg_info
        if dbg_info:
            self.ptr.set_dbg_info(dbg_info)
        self.ptr.type_check(impl.pytaichi.prog.config())
        self.ptr_type_checked = True

    return made


def initialised(usual: Callable) -> Callable:
    """``impl.expr_init``, which makes a variable of a kernel, with a shorter way if its value is an expression."""

    @functools.wraps(usual)
    def variable(value: Any) -> Any:
        if type(value) is not expr.Expr:
            return usual(value)
        runtime = impl.pytaichi
        place = core.DebugInfo(runtime.src_info_stack[-1])
        return expr.Expr(runtime.compiling_callable.ast_builder().expr_var(value.ptr, place))

    return variable


def building_constants(usual: Callable) -> Callable:
    """``expr.make_constant_expr``, with a shorter way for the usual numbers of Python."""

    @functools.wraps(usual)
    def make(value: Any, dtype: Any) -> Any:
        runtime, kind = impl.pytaichi, type(value)
        if dtype is None and kind is float:
            return expr.Expr(core.make_const_expr_fp(runtime.default_fp, value))
        has_32_bits = runtime.default_ip is ti.i32  # an equal type is another object: it takes the usual way
        if dtype is None and kind is int and has_32_bits and -SMALL <= value < SMALL:
            return expr.Expr(core.make_const_expr_int(ti.i32, value))
        return usual(value, dtype)

    return make


def except_for_taichi(usual: Callable) -> Callable:
    """``ASTTransformer.build_call_if_is_builtin``, which makes a table of Python's functions for each call of any.

    Functions of Taichi, and those with ``@ti.func``, are not in it.
    """

    @functools.wraps(usual)
    def build(context: Any, node: Any, *words: Any) -> bool:
        function = node.func.ptr
        if getattr(function, "_is_taichi_function", False):
            return False
        if type(function) is types.FunctionType and function.__module__.startswith("taichi."):
            return False
        return usual(context, node, *words)

    return build


def keeping_places(usual: Callable) -> Callable:
    """``core.DebugInfo``, the place of something for messages, made once for each text."""
    kept = functools.lru_cache(KEPT_PLACES)(usual)

    @functools.wraps(usual, updated=())
    def place(text: str) -> Any:
        return kept(text) if len(text) < LONG_TEXT else usual(text)

    return place


class Raising:
    """A builder for which building any node raises an error that was raised before."""

    def __init__(self, error: Exception) -> None:
        self.error = error

    def __getattr__(self, name: str) -> Callable:
        def build(*_words: Any) -> None:
            raise self.error

        return build


def building(usual: Callable) -> Callable:
    """``Builder.__call__``, which builds a node, with less around each node; ``usual``, Taichi's own, tells errors."""

    @functools.wraps(usual)
    def build(self: Any, context: Any, node: Any) -> Any:
        kind = type(node)
        if kind is ast.Constant:
            node.ptr = node.value
            return node.value
        name, has_place = BUILDING.get(kind, ("none", False))
        method = getattr(self, name, None)
        if method is None:
            return usual(self, context, node)
        places = impl.pytaichi.src_info_stack
        try:
            places.append(context.get_pos_info(node) if has_place else "")
            try:
                return method(context, node)
            finally:
                places.pop()
        except Exception as error:
            return usual(Raising(error), context, node)

    return build


# Type of a node → the method of a builder that builds it, and whether it has a place in the source.
BUILDING = {
    kind: (f"build_{kind.__name__}", issubclass(kind, (ast.stmt, ast.expr)))
    for kind in vars(ast).values()
    if isinstance(kind, type)
}


def building_operations(usual: Callable) -> Callable:
    """``ASTTransformer.build_BinOp``, which makes a table of all operators for each use of one of them."""

    @functools.wraps(usual)
    def build(context: Any, node: Any) -> Any:
        operation = OPERATIONS.get(type(node.op))
        if operation is None:
            return usual(context, node)
        ast_transformer.build_stmt(context, node.left)
        ast_transformer.build_stmt(context, node.right)
        try:
            node.ptr = operation(node.left.ptr, node.right.ptr)
        except TypeError as error:
            raise ti.TaichiTypeError(str(error)) from None
        return node.ptr

    return build


# Operators of numbers, and what they stand for.
OPERATIONS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
    ast.BitAnd: operator.and_,
}


@functools.lru_cache(maxsize=1)
def find_classes_quickly() -> None:
    """Let Taichi find the class of a function by ``frame_info``, from now on."""
    kernel_impl.inspect = types.SimpleNamespace(**vars(inspect) | {"getframeinfo": frame_info})


@functools.lru_cache(maxsize=1)
def keep_what_is_read() -> None:
    """Let Taichi keep what it reads of a function's source, from now on."""
    kernel_impl.getsourcefile = kept_per_function(kernel_impl.getsourcefile)
    kernel_impl.getsourcelines = kept_per_function(shorter(kernel_impl.getsourcelines, source_lines))
    kernel_impl.textwrap = types.SimpleNamespace(fill=fill, dedent=functools.lru_cache(4096)(textwrap.dedent))
    context = ast_transformer_utils.ASTTransformerContext
    context.get_pos_info = kept_per_node(shorter(context.get_pos_info, position))
    ast_transformer_utils.Builder.__call__ = building(ast_transformer_utils.Builder.__call__)
    transformer = ast_transformer.ASTTransformer
    transformer.build_BinOp = staticmethod(building_operations(transformer.build_BinOp))
    transformer.build_call_if_is_builtin = staticmethod(except_for_taichi(transformer.build_call_if_is_builtin))
    core.DebugInfo = keeping_places(core.DebugInfo)
    expr.make_constant_expr = building_constants(expr.make_constant_expr)
    expr.Expr.__init__ = with_short_way(expr.Expr.__init__)
    impl.expr_init = initialised(impl.expr_init)
    trees = Trees()
    kernel_impl.ast = types.SimpleNamespace(**vars(ast) | {"parse": trees.parse})
    kernel_impl.transform_tree = letting_go(kernel_impl.transform_tree, trees)
    core.Program.create_kernel = without_collections(core.Program.create_kernel)
    expr.np = types.SimpleNamespace(**vars(np) | {"iinfo": functools.lru_cache(np.iinfo)})
    for module in (impl, matrix, snode):
        if getattr(module, "get_traceback", None) is util.get_traceback:
            module.get_traceback = traceback_text
