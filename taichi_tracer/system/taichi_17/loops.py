"""Loops of kernels over fields in numpy's memory, whose lengths are arguments."""

import ast
import functools
from collections.abc import Callable
from typing import Any

import taichi as ti
from taichi.lang.ast import ast_transformer

from taichi_tracer.system.taichi_17.arguments import argument_for


def looping(usual: Callable) -> Callable:
    """``ASTTransformer.build_struct_for``: a loop over an ``memory.ArrayField`` is one over ``ti.ndrange(*shape)``."""

    @functools.wraps(usual)
    def build(context: Any, node: Any, is_grouped: bool) -> None:
        over = ast_transformer.build_stmt(context, node.iter) if is_grouped else node.iter.ptr
        argument = argument_for(over)
        if argument is None:
            return usual(context, node, is_grouped)
        indices = ast.Constant(ti.ndrange(*(argument.count(axis) for axis in range(len(argument.of.constant)))))
        ast.copy_location(indices, node.iter)
        if is_grouped:
            node.iter.args = [indices]
            return ast_transformer.ASTTransformer.build_grouped_ndrange_for(context, node)
        node.iter = indices
        return ast_transformer.ASTTransformer.build_ndrange_for(context, node)

    return build
