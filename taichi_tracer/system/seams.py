"""Where a student's method takes the place of ours: which methods were replaced, and how to call one by its signature.

The package contains fast forms that compute the same as the plain methods of the handouts. A fast form may run only
while the plain methods that it stands in for are those that came with the package: whoever replaces one, in a subclass
or by assigning to the class, must see their own code run. ``replaced`` answers that question for every part.
"""

import inspect
from types import SimpleNamespace

import taichi as ti

# Class → {name of a handout's method: the function that came with the package}.
_SHIPPED: dict[type, dict[str, object]] = {}


def seams(*names: str):
    """A class decorator: remembers the methods of the class that a student may replace, as they came."""

    def remember(cls: type) -> type:
        inherited = {}
        for base in reversed(cls.__mro__[1:]):
            inherited |= dict.fromkeys(_SHIPPED.get(base, {}))
        _SHIPPED[cls] = {name: inspect.getattr_static(cls, name) for name in [*inherited, *names]}
        return cls

    return remember


def replaced(part) -> tuple[str, ...]:
    """The names of the handout's methods that are not those of the package, for a class or an object.

    A method counts as replaced when a subclass outside the package defines it, when somebody assigned another function
    to the class, or when the object itself has an attribute of that name.
    """
    cls = part if isinstance(part, type) else type(part)
    home = next((base for base in cls.__mro__ if base in _SHIPPED), None)
    if home is None:
        return ()
    own = {} if isinstance(part, type) else getattr(part, "__dict__", {})
    shipped = _SHIPPED[home]
    return tuple(name for name in shipped if name in own or inspect.getattr_static(cls, name) is not shipped[name])


def assigned() -> list[str]:
    """The methods of the package's own classes that somebody assigned to, as "Camera.generate_ray"."""
    return [f"{cls.__name__}.{name}" for cls in _SHIPPED for name in replaced(cls)]


def why_replaced(part) -> str:
    """For receipts: "MyCamera replaces generate_ray"; "" when nothing is replaced."""
    names = replaced(part)
    cls = part if isinstance(part, type) else type(part)
    return f"{cls.__name__} replaces {', '.join(names)}" if names else ""


def takes(function, name: str) -> bool:
    """Whether a function has a parameter of this name."""
    return name in inspect.signature(function).parameters


def takes_whole_numbers(function) -> bool:
    """Whether the first argument of a function, after ``self``, is annotated as a whole number."""
    annotations = [p.annotation for p in inspect.signature(function).parameters.values() if p.name != "self"]
    return bool(annotations) and annotations[0] in (int, ti.i8, ti.i16, ti.i32, ti.i64, ti.u8, ti.u16, ti.u32, ti.u64)


def runs_in_kernels(function) -> bool:
    """Whether a function was written for kernels alone: with ``@ti.func``, and not for Python as well."""
    return hasattr(function, "_is_taichi_function") and not getattr(function, "is_for_python_too", False)


def in_kernels(function):
    """Let kernels call a Python function while they are compiled: it may inspect, choose, and call Taichi functions."""
    function._is_taichi_function = function.is_for_python_too = True
    function.func = SimpleNamespace(has_print=False)  # what Taichi asks of the functions that a kernel calls
    return function


@in_kernels
def called(method, *arguments, **offered):
    """``method(*arguments)``, with those of the offered arguments that it takes.

    A handout's signature is shorter than ours: ``generate_ndc_coords(pixel_x, pixel_y)`` knows no jitter, and
    ``sample_direction()`` draws its own random numbers. A function without ``self`` that was assigned to a class is
    called without it.
    """
    function = getattr(method, "__func__", None)
    if function is not None:
        names = list(inspect.signature(function).parameters)
        if not names or names[0] != "self":
            method = function
    return method(*arguments, **{name: value for name, value in offered.items() if takes(method, name)})
