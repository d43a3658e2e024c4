"""Nodes of syntax trees and expressions of kernels: built with less around each of them.

Around each node of a function's source, Taichi 1.7 makes tables, contexts and tests that do not depend on the node.
Here, the usual nodes have shorter ways. What is built, and each error, is Taichi's own.
"""

import ast
import functools
import operator
import types
from collections.abc import Callable
from typing import Any

import numpy as np
import taichi as ti
from taichi._lib import core
from taichi.lang import expr, impl
from taichi.lang.ast import ast_transformer

from taichi_tracer.system.taichi_17.sources import with_others

SMALL = 1 << 31  # integers from −SMALL on, below SMALL, have 32 bits


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


def keeping_limits(usual: types.ModuleType) -> types.ModuleType:
    """The module ``numpy`` for Taichi, whose ``iinfo`` is asked for each integer, and keeps its answers."""
    return with_others(usual, iinfo=functools.lru_cache(np.iinfo))
