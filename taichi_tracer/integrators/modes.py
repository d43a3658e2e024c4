"""What renderers show, as the course numbers it: ``renderer.shade_mode[None] == renderer.ShadeMode.HIT``."""

from enum import IntEnum
from typing import Any

from taichi_tracer.system.course_fields import held


class Mode(IntEnum):
    """A number of the course for what a renderer shows, with the name of the integrator: ``HIT = 1, "hit"``."""

    integrator: str

    def __new__(cls, number: int, integrator: str) -> "Mode":
        """A member with this number."""
        made = int.__new__(cls, number)
        made._value_, made.integrator = number, integrator
        return made


class ModeProperty:
    """The mode of a renderer as the course has it: ``renderer.shade_mode[None]`` is a number of its enumeration.

    Args:
        modes: the name of the enumeration in the class of the renderer.
    """

    def __init__(self, modes: str) -> None:
        self.modes = modes

    def __get__(self, renderer: Any, owner: type | None = None) -> Any:
        if renderer is None:
            return self
        modes = getattr(renderer, self.modes)
        found = [mode for mode in modes if mode.integrator == renderer.active.name]
        if not found:  # another form of one of them, such as "mis_one_sample"
            found = [mode for mode in modes if renderer.active.name.startswith(mode.integrator)]
        return held(int(found[0]) if found else 0, lambda number: self.__set__(renderer, number))

    def __set__(self, renderer: Any, number: int) -> None:
        renderer.use(getattr(renderer, self.modes)(number))


class ShadeMode(Mode):
    """The views, as the course numbers them."""

    HIT = 1, "hit"
    TRIANGLE_ID = 2, "triangle_id"
    DISTANCE = 3, "distance"
    BARYCENTRIC = 4, "barycentric"
    NORMAL = 5, "normal"
    MATERIAL_ID = 6, "material_id"


class SampleMode(Mode):
    """The estimators of assignment 2; ``use`` takes the others, by their names."""

    UNIFORM = 1, "uniform"
    BRDF = 2, "brdf"
    MICROFACET = 3, "microfacet"


class LampSampleMode(Mode):
    """The estimators of assignment 3; ``use`` takes the others, by their names."""

    UNIFORM = 1, "uniform"
    BRDF = 2, "brdf"
    LIGHT = 3, "environment"
    MIS = 4, "mis"


class ShadingMode(Mode):
    """How paths find light; ``use`` takes the third way, ``path``, by its name."""

    IMPLICIT = 1, "implicit"
    EXPLICIT = 2, "explicit"
