"""Words for functions, classes, modules and types, which mean the same in another process that runs the same files."""

import enum
import hashlib
import re
import sys
import types
from typing import Any

import numpy as np
import taichi as ti
from taichi._lib import core
from taichi.lang.matrix import MatrixType
from taichi.lang.struct import StructType

OWN = "taichi_tracer"
HOMES = {OWN, "taichi", "numpy", *sys.stdlib_module_names}  # packages whose versions ``kept.circumstances`` has
NUMBER = re.compile(r"[iuf]\d+")  # Taichi's names of the types of numbers
TENSOR = re.compile(r"\[Tensor \(([\d, ]+)\) ([iuf]\d+)\]")  # of vectors and matrices
trees: dict[int, str] = {}  # number of a tree → its form, while many places are asked for; cleared before
NAMED = (type, types.FunctionType, types.BuiltinFunctionType)


def word(value: Any) -> str | None:
    """A word for a value that is the same object throughout a process; None if it has none outside of the process."""
    if isinstance(value, core.DataType):
        return type_word(value)
    if isinstance(value, MatrixType):
        element = word(value.dtype)
        return element and f"{type(value).__name__} {value.n} {value.m} {value.ndim} {element}"
    if isinstance(value, types.ModuleType):
        return f"{value.__name__}:" if is_home(value.__name__) and sys.modules.get(value.__name__) is value else None
    if isinstance(value, np.dtype):
        return f"dtype {value.str}" if value.names is None else None
    if isinstance(value, enum.Enum):
        home = word(type(value))
        return home and f"{home}.{value.name}"
    if not isinstance(value, NAMED) or not is_home(value.__module__ or ""):
        return None
    if made_of := getattr(value, "__dict__", {}).get("made_of"):  # of ``observed``
        how, *parts = made_of
        words = [word(part) for part in parts]
        return None if None in words else f"{how} {words}"
    for text in (f"{value.__module__}:{value.__qualname__}", "types:MethodType", "types:NoneType"):
        if found(text) is value:
            return text
    if isinstance(value, type) and all(name.startswith("_") for name in vars(value)):  # has nothing of its own
        bases = [word(base) for base in value.__bases__]
        return None if None in bases else f"{value.__module__}:{value.__name__} of {bases}"
    if isinstance(value, types.FunctionType) and value.__closure__ is None and is_of_file(value):
        return f"{value.__module__}:{value.__qualname__}:{value.__code__.co_firstlineno}"
    return None


def place_word(node: Any) -> str | None:
    """A word for the place of a field in a tree of Taichi's, and for all of the tree; none in Taichi 1.7.3."""
    root = node
    while root.parent is not None:
        root = root.parent
    if not hasattr(root, "get_snode_tree_id"):
        return None
    number = root.get_snode_tree_id()
    if number not in trees:
        trees[number] = hashlib.sha256(repr((number, describe(root))).encode()).hexdigest()
    return f"{node.id} in {trees[number]}"


def describe(node: Any) -> Any:
    """The form of a node of a tree, and of all in it."""
    counts = [node.get_shape_along_axis(axis) for axis in range(node.num_active_indices())]
    bytes_in = node.cell_size_bytes, node.offset_bytes_in_parent_cell, node.get_physical_index_position()
    kind = node.data_type().to_string() if node.get_num_ch() == 0 else ""
    parts = [describe(node.get_ch(k)) for k in range(node.get_num_ch())]
    return node.id, str(node.type), kind, counts, bytes_in, parts


def type_word(kind: Any) -> str | None:
    """A word for a type of Taichi's: of numbers, or of the vectors and matrices in an array."""
    name = kind.to_string()
    return f"type {name}" if NUMBER.fullmatch(name) or TENSOR.fullmatch(name) else None


def type_of(text: str) -> Any:
    """The type of Taichi's that ``type_word`` has given a word."""
    name = text.removeprefix("type ")
    tensor = TENSOR.fullmatch(name)
    if tensor is None:
        return getattr(ti, name)
    shape = [int(count) for count in tensor[1].split(",")]
    return core.get_type_factory_instance().get_tensor_type(shape, getattr(ti, tensor[2]))


def found(text: str) -> Any:
    """What a word of a module and a name stands for in this process; None if it is nothing, or not imported."""
    module, _, name = text.partition(":")
    value = sys.modules.get(module)
    for part in name.split(".") if name else ():
        value = value.methods.get(part) if isinstance(value, StructType) else getattr(value, part, None)
    return value


def is_home(module: str) -> bool:
    """Whether a module is one whose source is as it was in every process of the same versions."""
    return module.partition(".")[0] in HOMES


def is_of_file(function: types.FunctionType) -> bool:
    """Whether a function is as the file of its module has it."""
    home = sys.modules.get(function.__module__)
    return function.__globals__ is getattr(home, "__dict__", None) and (
        function.__code__.co_filename == getattr(home, "__file__", None) and not function.__kwdefaults__
    )
