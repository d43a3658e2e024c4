"""The names of Taichi 1.7 that the package replaces: which, why, and what each of them gains.

``apply`` replaces them, for the whole process. ``runtime.init`` calls it, or the first scene if the program has started
Taichi itself; an import replaces nothing. With a version of Taichi that was not tried, nothing is replaced, nor where
the environment variable ``TAICHI_TRACER_PATCHES`` is ``none``; ``taichi-tracer doctor`` says so.

No patch changes what a kernel computes. The gains are seconds of the processor for the first picture of ``render
cornell_box --estimator path --spp 1 --size 64x64`` with kernels that are kept: 1.7 s without any patch, 0.9 s with all,
and so much more without one of them.
"""

import inspect
import os
from collections.abc import Callable
from typing import Any

import taichi as ti
from taichi._lib import core
from taichi.lang import impl, kernel_impl
from taichi.lang.ast.ast_transformer import ASTTransformer
from taichi.lang.common_ops import TaichiOperations
from taichi.lang.expr import Expr

from taichi_tracer.system.taichi_17 import arguments, blocks, own_code, sources

VARIABLE = "TAICHI_TRACER_PATCHES"
VERSIONS = (1, 7, 3), (1, 7, 4)  # of Taichi, with which the patches were tried
# What has a name of Taichi, the name, and what makes its replacement from it; the last is called first.
REPLACED: tuple[tuple[Any, str, Callable[[Any], Any]], ...] = (
    # 0.4 s: functions are found once, and the places that messages show are written in one line.
    (kernel_impl, "_get_tree_and_ctx", sources.finding_once),
    # 0.3 s of the 2.0 s of a picture whose kernels are not kept; 0 s of one whose kernels are.
    (kernel_impl.Func, "__call__", blocks.in_blocks),
    # 0.4 s, and no kernel for another mesh or size: fields are arguments of kernels, in numpy's memory.
    (core.Program, "create_kernel", arguments.reading),
    (core.Kernel, "make_launch_context", arguments.setting),
    (kernel_impl.Kernel, "__call__", arguments.launching),
    (impl, "subscript", arguments.subscripting),
    (ASTTransformer, "build_Attribute", arguments.loading),
    (ASTTransformer, "build_struct_for", arguments.looping),
    # No time: kernels and their seconds are counted, for messages, profiles and studies.
    (core.Program, "compile_kernel", arguments.counting_translating),
    # No time: a mistake in a part of one's own is one line, and does not end the process.
    (kernel_impl.Func, "__call__", own_code.looking),
    (Expr, "__bool__", own_code.deciding),
    (TaichiOperations, "__mul__", own_code.multiplying),
    (TaichiOperations, "_assign", own_code.assigning),
    (TaichiOperations, "_augassign", own_code.assigning),
)


def apply() -> str:
    """Replace the names, see ``runtime.patches``. Returns why they are not replaced; "" if they are."""
    if os.environ.get(VARIABLE) == "none":
        return f"{VARIABLE} is none"
    if ti.__version__ not in VERSIONS:
        return f"Taichi {'.'.join(map(str, ti.__version__))} was not tried"
    for owner, name, make in REPLACED:
        replacement = make(getattr(owner, name, None))
        is_static = isinstance(inspect.getattr_static(owner, name, None), staticmethod)
        setattr(owner, name, staticmethod(replacement) if is_static else replacement)
    return ""
