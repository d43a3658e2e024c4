"""What an integrator is: one sample of the radiance that arrives along a ray.

    L = integrator.radiance(scene, ray, hit, rng)

``scene`` is what kernels know of the scene (``scene_data.SceneInKernels``): its lights, its intersector, its effects,
and ``surface_at(ray, hit)``. ``hit`` is what the ray met. ``rng`` gives random numbers, ``rng.next_2d()``. The result
is one sample, a vec3: averaging belongs to the film (A2-9).
"""

from collections.abc import Callable

import taichi as ti
import taichi.math as tm

from taichi_tracer.system.seams import in_kernels, seams


@ti.data_oriented
@seams("radiance")
class Integrator:
    """The interface. A subclass says ``radiance``.

    Attributes:
        name: what ``use``, ``--view`` and ``--estimator`` take.
        label: what the window's button says; the name when empty.
        aliases: other names for the same.
        what: what one of them is called in messages, and which renderer offers it: "view" ``A1Renderer``, "estimator"
            ``A2Renderer``, "integrator" ``RT3Renderer``.
        srgb: whether the picture is radiance or colour, to be written with the sRGB transfer function (C-14).
        needs_light: whether a scene without any light shows nothing.
        samples_lights: whether it asks the scene's lights for directions.
    """

    kind, name, label, aliases = "integrator", "", "", ()
    what, srgb, needs_light, samples_lights = "estimator", True, True, True

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """Radiance arriving along the ray: one sample."""
        ti.static_assert(False, "an integrator must say what radiance(self, scene, ray, hit, rng) is")
        return tm.vec3(0)


@ti.data_oriented
@seams("radiance", "color")
class View(Integrator):
    """A view of the surface: a colour of what the ray hit. A miss is black.

    Args:
        name, label, aliases: as for ``Integrator``; None leaves those of the class.
        color: a ``@ti.func`` HitData → RGB in [0, 1]; a subclass may write it as a method instead.
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

    @in_kernels
    def color(self, hit):
        """RGB of a hit."""
        return self.function(hit)

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """``color`` of a hit, black for a miss."""
        value = tm.vec3(0)
        if hit.is_hit:
            value = self.color(hit)
        return value
