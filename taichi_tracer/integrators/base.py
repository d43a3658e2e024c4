"""The interface of an integrator: it takes one sample of the radiance that arrives along a ray.

    L = integrator.radiance(scene, ray, hit, rng)

``scene`` is a ``scene_in_kernels.SceneInKernels``: it has the lights, the intersector, the effects, and
``surface_at(ray, hit)``. ``hit`` is what the ray hit. ``rng.next_2d()`` gives two random numbers. The result is one
sample, a vec3. The film computes the mean of the samples (A2-9).

``Integrator.controls`` returns the values that can be changed while a picture is shown, with their present values;
``Integrator.change`` takes the new ones by name.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import taichi as ti

from taichi_tracer.camera import ProjectiveCamera
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.heuristics import heuristic
from taichi_tracer.system import memory
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import overridable, replaced

if TYPE_CHECKING:
    from taichi_tracer.scene_data import SceneData

# ── values that can be changed ──


@dataclass(frozen=True)
class Control:
    """A value that can be changed: a number between two ends, which belong to it, or one of several names.

    Attributes:
        name: of the value, for ``Integrator.change``.
        low, high: the ends; the number is whole if both are whole.
        names: what a button chooses one after another.
    """

    name: str
    value: float | str
    low: float = 0
    high: float = 0
    names: Sequence[str] = ()


@ti.data_oriented
class LiveNumbers:
    """A row of numbers in the running precision, which kernels read. A change compiles nothing again."""

    def __init__(self) -> None:
        self._memory: memory.Memory | None = None

    def set(self, *numbers: float) -> None:
        """Set all numbers. They get their memory at the first time, and when Taichi was started again since then."""
        if self._memory is None or self._memory.is_over():
            self._memory, (self._field,) = memory.filled(np.array(numbers, float))
        else:
            self._memory.write(self._field, numbers)

    @ti.func
    def get(self, i: ti.template()):
        """The i-th number; in kernels."""
        return self._field[i]


# ── integrators ──


@ti.data_oriented
@overridable(radiance="vec3", heuristic="number")
class Integrator:
    """The interface. A subclass defines ``radiance``.

    Attributes:
        name: the name that ``use``, ``--view`` and ``--estimator`` take.
        label: the text of the button in the window; if it is empty, the name is shown.
        aliases: other names for the same integrator.
        what: its kind, which decides the renderer that offers it and the word in messages: "view" for ``A1Renderer``,
            "estimator" for ``A2Renderer``, "integrator" for ``RT3Renderer``.
        srgb: whether the picture is radiance or colour; then it is written with the sRGB transfer function (C-14).
        needs_light: whether it shows nothing in a scene without light.
        samples_lights: whether it draws directions from the lights, as ``lights.sample`` does.
        samples_brdf: whether light counts that it finds along directions drawn from the BRDF.
        microfacets: whether the roughness decides, and not Ns, where a material has both (A2-12).
        exponent: β of the heuristic that weights as many samples of the BRDF as of the lights; 0 if there is none.
        version: counts changes of its own values, so that a renderer knows when samples belong to an older picture.
        numbers: those of its values that kernels read, if it has some; ``prepare`` sets them.
    """

    kind, name, label = "integrator", "", ""
    aliases: tuple[str, ...] = ()
    what, srgb, needs_light, samples_lights, samples_brdf = "estimator", True, True, True, True
    required: tuple[str, ...] = ("radiance",)
    microfacets = False
    exponent = 0
    version = 0

    def __copy__(self) -> "Integrator":
        """The same values; kernels read them from a place of its own."""
        copied = object.__new__(type(self))
        vars(copied).update(vars(self), numbers=LiveNumbers())
        return copied

    @property
    def compensates(self) -> bool:
        """Whether samples of the lights may leave out what those of the BRDF find, see ``lights.environment_light``.

        The sum is less noisy then. A student's method need not weight them as the package's do.
        """
        return self.exponent > 0 and type(self).__module__.startswith(__package__) and not replaced(self)

    def prepare(self, scene_data: "SceneData", camera: ProjectiveCamera) -> None:
        """Bring values that depend on the scene or the camera up to date; it is called whenever a picture begins."""

    def facts(self) -> dict:
        """Its own values on which the bits of a picture depend, for checkpoints."""
        return {}

    def controls(self) -> tuple[Control, ...]:
        """The values that can be changed while the picture is shown, as far as they have an effect at present."""
        return ()

    def change(self, name: str, value: Any) -> None:
        """Change a value of ``controls``.

        Raises:
            InputError: there is no such value, or it is out of its range; then nothing has changed.
        """
        raise InputError(f"{self.name} has no {name} that can be changed")

    def notes(self) -> list[str]:
        """What the user should know about the picture that was begun, one line each."""
        return []

    @ti.func
    def heuristic(self, pdf, other):
        """The weight of a direction of the density ``pdf`` that another kind of samples finds with ``other`` (A3-4)."""
        return heuristic(pdf, other, self.exponent)

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """One sample of the radiance that arrives along the ray."""
        ti.static_assert(False, "an integrator must say what radiance(self, scene, ray, hit, rng) is")


@ti.data_oriented
@overridable(radiance="vec3", color="vec3")
class View(Integrator):
    """A view of the surface: it turns a hit into a colour. A miss is black.

    Args:
        name, label, aliases: as for ``Integrator``; with None, the attributes of the class stay.
        color: a ``@ti.func`` HitData → RGB in [0, 1]. A subclass may define a method ``color`` instead.
    """

    what, srgb, needs_light, samples_lights = "view", False, False, False

    def __init__(
        self,
        name: str | None = None,
        label: str | None = None,
        color: Callable | None = None,
        aliases: tuple[str, ...] | None = None,
    ) -> None:
        self.name = self.name if name is None else name
        self.label = self.label if label is None else label
        self.aliases = self.aliases if aliases is None else aliases
        self.function = color

    @property
    def required(self) -> tuple[str, ...]:  # type: ignore[override]
        """``color``, unless there is a function of it, or a ``radiance`` that does not ask for it."""
        has_other = self.function is not None or type(self).radiance is not View.radiance
        return () if has_other else ("color",)

    @compile_time
    def color(self, hit):
        """The RGB colour of a hit."""
        if self.function is None:
            raise NotImplementedError(f"{type(self).__name__} must say what color(self, hit) is")
        return self.function(hit)

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """``color`` of a hit; black for a miss."""
        value = tm.vec3(0)
        if hit.is_hit:
            value = self.color(hit)
        return value
