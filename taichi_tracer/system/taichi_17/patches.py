"""The names of Taichi 1.7 that the package replaces: which, why, and what each of them gains.

``apply`` replaces them, for the whole process. ``runtime.init`` calls it, or the first scene if the program has started
Taichi itself; an import replaces nothing. A patch is left out, with a reason that ``taichi-tracer doctor`` shows, if
Taichi's version is another one, or if one of its names is missing or has other parameters than are expected. The
environment variable ``TAICHI_TRACER_PATCHES`` names those that are wanted: ``none``, ``all``, or a list with commas.

No patch changes what a kernel computes.
"""

import functools
import inspect
import os
import pkgutil
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import taichi as ti

from taichi_tracer.system.errors import one_of

VARIABLE = "TAICHI_TRACER_PATCHES"
VERSIONS = (1, 7)  # of Taichi: 1.7.3 and 1.7.4 were tried
COMPILED = "compiled"  # instead of parameters: a function or a class of Taichi's C++ library
MODULE = "module"  # instead of parameters: a module that another one of Taichi's has imported


@dataclass(frozen=True)
class Patch:
    """Some names of Taichi that are replaced together.

    Attributes:
        name: the name for the switch.
        gain: what it gains: seconds of the processor for the first picture of ``render cornell_box --estimator path
            --spp 1 --size 64x64`` with kernels that are kept, if the patches are added in this order: from 2.3 s
            without any to 1.0 s with all.
        replaces: for each name of Taichi, as ``pkgutil.resolve_name`` takes it: the parameters that it is expected to
            have, and the function of this folder that makes its replacement from it.
        needs: names of Taichi that are only used.
        then: a function of this folder that is called afterwards; "" is none.
    """

    name: str
    gain: str
    replaces: dict[str, tuple[str, str]]
    needs: tuple[str, ...] = ()
    then: str = ""


PATCHES = (
    Patch(
        "sources",
        "0.42 s: functions are found, read and parsed once",
        {
            "taichi.lang.kernel_impl:getsourcefile": ("obj", "sources:kept_per_function"),
            "taichi.lang.kernel_impl:getsourcelines": ("obj", "sources:finding_lines"),
            "taichi.lang.kernel_impl:textwrap": (MODULE, "sources:filling"),
            "taichi.lang.kernel_impl:ast": (MODULE, "sources:parsing"),
            "taichi.lang.kernel_impl:transform_tree": ("tree ctx", "sources:letting_go"),
        },
    ),
    Patch(
        "messages",
        "0.75 s: the places that messages show are written once",
        {
            "taichi.lang.ast.ast_transformer_utils:ASTTransformerContext.get_pos_info": (
                "self node",
                "messages:describing",
            ),
            "taichi._lib:core.DebugInfo": (COMPILED, "messages:keeping_places"),
            "taichi.lang.impl:get_traceback": ("stacklevel", "messages:telling_callers"),
            "taichi.lang.matrix:get_traceback": ("stacklevel", "messages:telling_callers"),
            "taichi.lang.snode:get_traceback": ("stacklevel", "messages:telling_callers"),
        },
    ),
    Patch(
        "blocks",
        "0.5 s of the 2.2 s of a picture whose kernels are not kept; 0 s of one whose kernels are",
        {"taichi.lang.kernel_impl:Func.__call__": ("self args kwargs", "blocks:in_blocks")},
        needs=("taichi._lib:core.ASTBuilder.expr_alloca", "taichi.lang.impl:begin_frontend_if"),
    ),
    Patch(  # before "counters", which looks at what Taichi calls to build a kernel
        "arguments",
        "0.14 s, and no kernel for another mesh or size: fields are arguments of kernels, in numpy's memory",
        {
            "taichi._lib:core.Program.create_kernel": (COMPILED, "arguments:reading"),
            "taichi._lib:core.Kernel.make_launch_context": (COMPILED, "arguments:setting"),
            "taichi.lang.kernel_impl:Kernel.ensure_compiled": ("self args", "arguments:reading_again"),
            "taichi.lang.impl:subscript": ("ast_builder value _indices skip_reordered", "arguments:subscripting"),
            "taichi.lang.ast.ast_transformer:ASTTransformer.build_Attribute": ("ctx node", "arguments:loading"),
            "taichi.lang.ast.ast_transformer:ASTTransformer.build_struct_for": (
                "ctx node is_grouped",
                "loops:looping",
            ),
        },
        needs=(
            "taichi._lib:core.make_external_tensor_expr",
            "taichi._lib:core.make_arg_load_expr",
            "taichi._lib:core.KernelLaunchContext.set_arg_external_array_with_shape",
        ),
        then="arguments:use",
    ),
    Patch(
        "threads",
        "no time: kernels of several threads are read, translated and launched one after the other",
        {"taichi.lang.kernel_impl:Kernel.__call__": ("self args kwargs", "kernels:one_at_a_time")},
    ),
    Patch(
        "counters",
        "no time: it counts the kernels and their seconds, for messages, profiles and studies",
        {
            "taichi._lib:core.Program.create_kernel": (COMPILED, "kernels:counting_reading"),
            "taichi._lib:core.Program.compile_kernel": (COMPILED, "kernels:counting_translating"),
        },
    ),
    Patch(
        "own code",
        "no time: a mistake in a part of one's own is one line, and does not end the process",
        {
            "taichi.lang.kernel_impl:Func.__call__": ("self args kwargs", "own_code:looking"),
            "taichi._lib:core.Program.create_kernel": (COMPILED, "own_code:telling"),
            "taichi.lang.common_ops:TaichiOperations.__mul__": ("self other", "own_code:multiplying"),
            "taichi.lang.common_ops:TaichiOperations._assign": ("self other", "own_code:assigning"),
            "taichi.lang.common_ops:TaichiOperations._augassign": ("self x op", "own_code:assigning"),
        },
    ),
    Patch(
        "powers",
        "no time: a power of a power does not end the process",
        {"taichi.lang.common_ops:TaichiOperations.__pow__": ("self other modulo", "powers:of_a_value")},
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
    reasons = {patch.name: why_not(patch) if patch.name in chosen else f"not in {VARIABLE}" for patch in PATCHES}
    for patch in PATCHES:
        if not reasons[patch.name]:
            for name, (_, maker) in patch.replaces.items():
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


def why_not(patch: Patch) -> str:
    """Why a patch does not fit the Taichi that is installed; "" if it does."""
    if ti.__version__[: len(VERSIONS)] != VERSIONS:
        return f"Taichi {'.'.join(map(str, ti.__version__))} was not tried"
    try:
        for name in patch.needs:
            pkgutil.resolve_name(name)
        for name, (expected, maker) in patch.replaces.items():
            found = parameters(pkgutil.resolve_name(name))
            if found != expected:
                return f"{name} has the parameters ({found}), not ({expected})"
            of_this_folder(maker)
    except (ImportError, AttributeError) as error:
        return str(error)
    return ""


def parameters(value: Any) -> str:
    """The names of a function's parameters; ``COMPILED`` if they are not known, ``MODULE`` of a module."""
    if isinstance(value, ModuleType):
        return MODULE
    try:
        return " ".join(inspect.signature(value).parameters)
    except ValueError:
        return COMPILED


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
