"""The names of Taichi 1.7 that the package replaces: which, why, and what each of them gains.

``apply`` replaces them, for the whole process. ``runtime.init`` calls it, or the first scene if the program has started
Taichi itself; an import replaces nothing. With a version of Taichi that was not tried, nothing is replaced, and
``taichi-tracer doctor`` says so. The environment variable ``TAICHI_TRACER_PATCHES`` names those that are wanted:
``none``, ``all``, or a list with commas.

No patch changes what a kernel computes.
"""

import functools
import inspect
import os
import pkgutil
from dataclasses import dataclass
from typing import Any

import taichi as ti

from taichi_tracer.system.errors import one_of

VARIABLE = "TAICHI_TRACER_PATCHES"
VERSIONS = (1, 7, 3), (1, 7, 4)  # of Taichi, with which the patches were tried


@dataclass(frozen=True)
class Patch:
    """Some names of Taichi that are replaced together.

    Attributes:
        name: the name for the switch.
        gain: what it gains: seconds of the processor for the first picture of ``render cornell_box --estimator path
            --spp 1 --size 64x64`` with kernels that are kept, if the patches are added in this order: from 2.9 s
            without any to 1.1 s with all.
        replaces: for each name of Taichi, as ``pkgutil.resolve_name`` takes it, the function of this folder that makes
            its replacement from it.
        then: a function of this folder that is called afterwards; "" is none.
    """

    name: str
    gain: str
    replaces: dict[str, str]
    then: str = ""


PATCHES = (
    Patch(
        "sources",
        "1.5 s: functions are found once, and the places that messages show are written in one line",
        {
            "taichi.lang.kernel_impl:_get_tree_and_ctx": "sources:finding_once",
            "taichi._lib:core.Program.create_kernel": "sources:letting_go",
        },
    ),
    Patch(
        "blocks",
        "0.5 s of the 2.2 s of a picture whose kernels are not kept; 0 s of one whose kernels are",
        {"taichi.lang.kernel_impl:Func.__call__": "blocks:in_blocks"},
    ),
    Patch(  # before "counters", which looks at what Taichi calls to build a kernel
        "arguments",
        "0.14 s, and no kernel for another mesh or size: fields are arguments of kernels, in numpy's memory",
        {
            "taichi._lib:core.Program.create_kernel": "arguments:reading",
            "taichi._lib:core.Kernel.make_launch_context": "arguments:setting",
            "taichi.lang.kernel_impl:Kernel.__call__": "arguments:launching",
            "taichi.lang.impl:subscript": "arguments:subscripting",
            "taichi.lang.ast.ast_transformer:ASTTransformer.build_Attribute": "arguments:loading",
            "taichi.lang.ast.ast_transformer:ASTTransformer.build_struct_for": "arguments:looping",
        },
        then="arguments:use",
    ),
    Patch(
        "counters",
        "no time: it counts the kernels and their seconds, for messages, profiles and studies",
        {
            "taichi._lib:core.Program.create_kernel": "arguments:counting_reading",
            "taichi._lib:core.Program.compile_kernel": "arguments:counting_translating",
        },
    ),
    Patch(
        "own code",
        "no time: a mistake in a part of one's own is one line, and does not end the process",
        {
            "taichi.lang.kernel_impl:Func.__call__": "own_code:looking",
            "taichi._lib:core.Program.create_kernel": "own_code:telling",
            "taichi.lang.common_ops:TaichiOperations.__mul__": "own_code:multiplying",
            "taichi.lang.common_ops:TaichiOperations._assign": "own_code:assigning",
            "taichi.lang.common_ops:TaichiOperations._augassign": "own_code:assigning",
        },
    ),
)
NAMES = tuple(patch.name for patch in PATCHES)


@functools.lru_cache(maxsize=1)
def apply() -> dict[str, str]:
    """Replace the names of all patches that are wanted and fit, once in a process.

    Returns:
        name of each patch → why it is not in use; "" for those that are.

    Raises:
        InputError: the environment variable names a patch that there is not.
    """
    chosen = wanted(os.environ.get(VARIABLE, ""))
    reasons = {patch.name: why_not() if patch.name in chosen else f"not in {VARIABLE}" for patch in PATCHES}
    for patch in PATCHES:
        if not reasons[patch.name]:
            for name, maker in patch.replaces.items():
                replace(name, maker)
            if patch.then:
                of_this_folder(patch.then)()
    return reasons


def wanted(text: str) -> tuple[str, ...]:
    """The names of the patches that a value of the environment variable asks for; "" asks for all."""
    names = [name.strip() for name in text.split(",") if name.strip()]
    if names in ([], ["all"]):
        return NAMES
    if names == ["none"]:
        return ()
    for name in names:
        if name not in NAMES:
            raise one_of(f"patch in {VARIABLE}", name, (*NAMES, "all", "none"))
    return tuple(names)


def why_not() -> str:
    """Why the patches do not fit the Taichi that is installed; "" if they do."""
    return "" if ti.__version__ in VERSIONS else f"Taichi {'.'.join(map(str, ti.__version__))} was not tried"


def replace(name: str, maker: str) -> None:
    """Replace a name of Taichi by what a function of this folder makes from it."""
    holder, attribute = place_of(name)
    is_static = isinstance(inspect.getattr_static(holder, attribute), staticmethod)
    made = of_this_folder(maker)(getattr(holder, attribute))
    setattr(holder, attribute, staticmethod(made) if is_static else made)


def place_of(name: str) -> tuple[Any, str]:
    """The module or class that has a name of Taichi, and the last word of the name."""
    owner, _, attribute = name.rpartition("." if "." in name.partition(":")[2] else ":")
    return pkgutil.resolve_name(owner), attribute


def of_this_folder(name: str) -> Any:
    """A function of this folder, as "sources:parsing"."""
    return pkgutil.resolve_name(f"{__package__}.{name}")
