"""One registry for everything that can be chosen by name: cameras, intersectors, samplers, BRDFs, lights, integrators.

A part is registered in the file that defines it, and is then known to the command line, the window, the studies and the
contract tests:

    @tt.register
    class Fisheye(tt.Camera):
        name = "fisheye"
        ...

Each kind of part has a home: the modules that define the parts that come with the package. They are imported when a
part of the kind is first asked for.
"""

import importlib
import pkgutil
from collections.abc import Callable

from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.seams import assigned

# Kind → (the modules or packages that define its parts, whether the registry holds objects instead of classes).
HOMES: dict[str, tuple[tuple[str, ...], bool]] = {
    "camera": (("camera",), False),
    "triangle test": (("formulas.triangles",), True),
    "intersector": (("intersectors", "ray_intersector"), False),
    "sampler": (("sampler",), True),
    "BRDF": (("brdfs",), True),
    "light": (("lights",), True),
    "integrator": (("integrators",), True),
    "renderer": (("renderer", "rt3.renderer"), False),
}


class Registry:
    """Parts by kind and name."""

    def __init__(self) -> None:
        self._parts: dict[str, dict[str, object]] = {kind: {} for kind in HOMES}
        self._loaded: set[str] = set()

    def add(self, part):
        """Register a part; returns it, so that this is a decorator of classes.

        Args:
            part: a class or an object that derives from the base class of a kind and has a ``name``. Of samplers,
                BRDFs, lights and integrators the registry holds objects: a class is called without arguments.

        Raises:
            InputError: it has no kind, no name, or the name of another part of its kind.
        """
        kind, name = getattr(part, "kind", None), getattr(part, "name", None)
        what = part.__name__ if isinstance(part, type) else type(part).__name__
        if kind not in HOMES:
            bases = "Camera, RayIntersector, Sampler, Brdf, Light, Integrator, View"
            raise InputError(f"register: {what} derives from none of the parts that can be registered ({bases})")
        if not isinstance(name, str) or name == "":
            raise InputError(f"register: {what} needs a name: name = {what.lower()!r} in the class")
        held = part() if HOMES[kind][1] and isinstance(part, type) else part
        known = self._parts[kind]
        if name in known and _origin(known[name]) != _origin(held):
            raise InputError(f"register: there is another {kind} called {name!r}, {_origin(known[name])[1]}")
        known[name] = held
        return part

    def remove(self, part) -> None:
        """Forget a part."""
        self._parts[part.kind].pop(part.name, None)

    def all(self, kind: str) -> list:
        """Every part of a kind, those that come with the package first."""
        self._load(kind)
        return list(self._parts[kind].values())

    def names(self, kind: str) -> list[str]:
        """Their names."""
        return [part.name for part in self.all(kind)]

    def find(self, kind: str, chosen):
        """The part that a slot was given: by its name, or as a class or an object.

        Raises:
            InputError: an unknown name, or something that is no part of this kind.
        """
        if isinstance(chosen, str):
            known = {name: part for part in self.all(kind) for name in (part.name, *getattr(part, "aliases", ()))}
            if chosen not in known:
                raise one_of(kind, chosen, self.names(kind))
            return known[chosen]
        if getattr(chosen, "kind", None) != kind:
            raise InputError(f"{kind}: {chosen!r} is neither a name nor a part of this kind")
        return chosen() if HOMES[kind][1] and isinstance(chosen, type) else chosen

    def _load(self, kind: str) -> None:
        """Import the home of a kind."""
        if kind in self._loaded:
            return
        self._loaded.add(kind)
        given = self._parts[kind]  # registered before: they come after those of the package
        self._parts[kind] = {}
        for name in HOMES[kind][0]:
            module = importlib.import_module(f"taichi_tracer.{name}")
            for found in sorted(m.name for m in pkgutil.iter_modules(getattr(module, "__path__", []))):
                importlib.import_module(f"taichi_tracer.{name}.{found}")
        shipped = {n: p for n, p in {**given, **self._parts[kind]}.items() if _origin(p)[0]}
        self._parts[kind] = {**shipped, **{n: p for n, p in given.items() if n not in shipped}}


def _origin(part) -> tuple[bool, str]:
    """Whether a part comes with the package, and the dotted name of its class."""
    cls = part if isinstance(part, type) else type(part)
    return cls.__module__.startswith("taichi_tracer."), f"{cls.__module__}.{cls.__qualname__}"


PARTS = Registry()


def register(part):
    """Make a part known under its name, everywhere: see ``Registry.add``. Works as a decorator of classes."""
    return PARTS.add(part)


def load_parts(path: str) -> list:
    """Run a Python file that registers parts, or assigns methods to the package's classes; returns the parts.

    Raises:
        InputError: the file is missing or is no Python; what went wrong stands in the message, with its line.
    """
    import runpy
    import traceback
    from pathlib import Path

    file = Path(path).expanduser()
    if not file.is_file():
        raise InputError(f"--parts {path}: no such file")
    before = {id(part) for parts in PARTS._parts.values() for part in parts.values()}
    try:
        runpy.run_path(str(file), run_name=file.stem)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except Exception as error:
        frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == str(file)]
        line = getattr(error, "lineno", None) or (frames[-1].lineno if frames else 1)
        raise InputError(f"{path}:{line}: {type(error).__name__}: {error}") from error
    added = [part for parts in PARTS._parts.values() for part in parts.values() if id(part) not in before]
    if not added and not assigned():
        raise InputError(f"{path}: the file registers nothing: put @tt.register before each class")
    return added


def choose(kind: str) -> Callable:
    """``PARTS.find`` for one kind."""
    return lambda chosen: PARTS.find(kind, chosen)
