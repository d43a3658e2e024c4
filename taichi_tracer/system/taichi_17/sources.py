"""The sources of functions: found once, and shown in one line by messages.

Wherever a kernel calls a function, Taichi 1.7 looks for that function's source again, and wraps each of its lines. For
each expression, it writes out the lines that an error message would show, with marks below the columns.
"""

import ast
import functools
import inspect
import linecache
import re
import textwrap
import types
from collections.abc import Callable
from typing import Any

from taichi.lang import kernel_impl
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext

from taichi_tracer.system.own_code.checks import fault_at


class Context(ASTTransformerContext):
    """What Taichi knows while it reads a function."""

    def get_pos_info(self, node: Any) -> str:
        """The place of a node: the file, the line, and its text."""
        name, line = self.func.func.__name__, self.src[node.lineno - 1]
        return f'File "{self.file}", line {node.lineno + self.lineno_offset}, in {name}:\n{line}\n'


# Those of the kernel that is read. They belong to cycles of objects, which Python finds late: ``arguments.reading``
# takes the arguments of the kernel's first call out of them, so that arrays and scenes do not stay in memory.
contexts: list[Context] = []


@functools.cache
def source_of(function: Callable, is_plain: bool = True) -> tuple[str, list[str], int]:
    """The file of a function, its lines, and the number of the first.

    Args:
        is_plain: whether its lines are those down to the next that begins as far to the left as ``def``. They are found
            in a tenth of the time that ``inspect`` takes, which knows strings that begin there, too.
    """
    code = inspect.unwrap(function).__code__
    lines, first = (own_lines(code), code.co_firstlineno) if is_plain else kernel_impl.getsourcelines(function)
    return code.co_filename, [line.rstrip().expandtabs(4) for line in lines], first


def own_lines(code: types.CodeType) -> list[str]:
    """The lines of a plain function."""
    linecache.checkcache(code.co_filename)
    lines = linecache.getlines(code.co_filename)[code.co_firstlineno - 1 :]
    head = next((line for line in lines if line.lstrip().startswith("def ")), "")
    if not head:
        raise fault_at(code.co_filename, code.co_firstlineno, "kernels call no lambda: write a function with def")
    left = re.compile(rf"\s{{0,{len(head) - len(head.lstrip())}}}[^\s#)]")
    end = (k for k, line in enumerate(lines) if k > lines.index(head) and left.match(line))
    return lines[: next(end, None)]


def finding_once(_usual: Callable) -> Callable:
    """``_get_tree_and_ctx``: the syntax tree of a function, and the context in which Taichi reads it."""

    def tree_and_context(
        self: Any, excluded_parameters: Any = (), is_kernel: bool = True, args: Any = None, **more: Any
    ) -> tuple[ast.Module, Context]:
        file, lines, first = source_of(self.func)
        try:
            tree: Any = ast.parse(textwrap.dedent("\n".join(lines)))
        except SyntaxError:
            file, lines, first = source_of(self.func, is_plain=False)
            tree = ast.parse(textwrap.dedent("\n".join(lines)))
        tree.body[0].decorator_list = []
        if any("**" in line for line in lines):
            part_powers(tree)
        known = kernel_impl._get_global_vars(self.func)
        if is_kernel or more.get("is_real_function"):
            known |= {self.arguments[k].name: args[k] for k in self.template_slot_locations}
        context = Context(
            excluded_parameters=excluded_parameters,
            is_kernel=is_kernel,
            func=self,
            global_vars=known,
            argument_data=args,
            src=lines,
            start_lineno=first,
            file=file,
            **{"arg_features": None, **more},
        )
        contexts.append(context)
        return tree, context

    return tree_and_context


def part_powers(tree: ast.Module) -> None:
    """Write −(−x) for the base x of each power: it has the bits of x, and LLVM leaves nothing of it.

    The package starts Taichi without Taichi's own optimisation passes, which take half of the compilation. Then Taichi
    1.7 writes a power with a whole exponent as a loop, and ends the process if the base is the result of such a loop.
    """
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            negative = ast.UnaryOp(ast.USub(), ast.UnaryOp(ast.USub(), node.left))
            node.left = ast.fix_missing_locations(ast.copy_location(negative, node.left))
