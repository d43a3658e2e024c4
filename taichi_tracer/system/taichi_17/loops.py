"""Loops of kernels whose lengths are arguments: over a field in numpy's memory, and over ranges of varying numbers."""

import functools
from collections.abc import Callable
from typing import Any

import taichi as ti
from taichi._lib import core
from taichi.lang import impl, matrix
from taichi.lang.ast import ast_transformer
from taichi.lang.expr import Expr

from taichi_tracer.system.taichi_17.arguments import Argument, argument_for


def looping(usual: Callable) -> Callable:
    """``ASTTransformer.build_struct_for``, which loops over all indices of an ``arrays.ArrayField``."""

    @functools.wraps(usual)
    def build(context: Any, node: Any, is_grouped: bool) -> None:
        over = ast_transformer.build_stmt(context, node.iter) if is_grouped else node.iter.ptr
        argument = argument_for(over)
        if argument is None:
            return usual(context, node, is_grouped)
        return loop(context, node, argument, is_grouped)

    return build


def loop(context: Any, node: Any, argument: Argument, is_grouped: bool) -> None:
    """Build a loop over all indices of a field: over their number, from which the indices are computed."""
    targets = ast_transformer.ASTTransformer.get_for_loop_targets(node)
    of = argument.of
    for target in targets:
        context.check_loop_var(target)
    if len(targets) != (1 if is_grouped else len(of.constant)):
        raise ti.TaichiSyntaxError(f"a loop over a field with {len(of.constant)} axes has {len(targets)} variables")
    counts = [argument.count(axis) for axis in range(len(of.constant))]
    builder = context.ast_builder
    with context.variable_scope_guard():
        number = Expr(builder.make_id_expr(""))
        total = Expr(functools.reduce(lambda a, b: a * b, counts))
        place = core.DebugInfo(impl.get_runtime().get_current_src_info())
        builder.begin_frontend_range_for(number.ptr, Expr(0).ptr, total.ptr, place)
        rest: Any = impl.expr_init(number)
        indices: list[Any] = []
        for count in counts[:0:-1]:
            above = impl.expr_init(ti.raw_div(rest, count))
            indices.insert(0, rest - above * count)
            rest = above
        indices = [impl.expr_init(index) for index in [rest, *indices]]
        if is_grouped:
            context.create_variable(targets[0], matrix.make_matrix(indices, dt=ti.i32))
        else:
            for target, index in zip(targets, indices, strict=True):
                context.create_variable(target, index)
        ast_transformer.build_stmts(context, node.body)
        builder.end_frontend_range_for()
