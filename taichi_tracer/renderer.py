"""The renderers of the assignments: what each offers, with the methods that the handouts name."""

import functools
from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING, Any, TypeVar

import taichi as ti

from taichi_tracer.files.images import Picture
from taichi_tracer.integrators.path_settings import DEFAULTS, Bounces, check_terms
from taichi_tracer.integrators.surface_views import ID_COLOR, ID_COLOR_UNIT
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer_parts import IntegratorChoice, PathValues, Value
from taichi_tracer.settings import WEIGHTS, usual_values
from taichi_tracer.system.compile_time import compile_time, inside_kernel
from taichi_tracer.system.course_fields import held
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.importing import import_quickly
from taichi_tracer.system.parts import PARTS, call_with_known_args, overridable, register

if TYPE_CHECKING:
    from typing_extensions import Self

SAME_WEIGHT = 1e-6  # of weights from 0 to 1: a slider gives back in f32 what it got


Renderer = TypeVar("Renderer", bound=ProgressiveRenderer)


def chooses(integrator: str) -> Callable[[Renderer], Renderer]:
    """A method of the handouts that lets a renderer use an integrator, and returns the renderer."""

    def choose(renderer: Renderer) -> Renderer:
        return renderer.use(integrator)

    choose.__doc__ = f"The same as use({integrator!r}). Returns the renderer."
    return choose


class Mode:
    """What a renderer shows, as the course numbers it: ``renderer.shade_mode[None] == renderer.ShadeMode.HIT``.

    The members of the enumeration have names of integrators, in capital letters.

    Args:
        modes: the name of the enumeration in the class of the renderer.
    """

    def __init__(self, modes: str) -> None:
        self.modes = modes

    def __get__(self, renderer: Any, owner: type | None = None) -> Any:
        if renderer is None:
            return self
        name, aliases = renderer.active.name, renderer.active.aliases
        modes = {mode.name.lower(): int(mode) for mode in getattr(renderer, self.modes)}
        found = [number for own, number in modes.items() if own in aliases or name.startswith(own)]  # "mis_balance"
        return held(found[0] if found else 0, functools.partial(self.__set__, renderer))

    def __set__(self, renderer: Any, number: int) -> None:
        renderer.use(getattr(renderer, self.modes)(number))


class Weight(Value):
    """A weight of ``mis_one_sample``; in ``[None]``, both add up to 1."""

    of = "_one_sample"

    def assign(self, renderer: Any, value: Any) -> None:
        """Set the weight, and the other one to what is left of 1; choose the estimator that has weights."""
        if not 0 <= value <= 1:
            raise InputError(f"{self.name}[None] must be a number from 0 to 1, not {value!r}")
        light = value if self.name == "mis_plight" else 1 - value
        if abs(renderer.mis_plight - light) > SAME_WEIGHT:
            renderer._one_sample.set(mis_plight=light, mis_pbrdf=1 - light)
            if renderer.active.name == "mis":
                renderer.use("mis_one_sample")


@register
@overridable(
    shade_hit="vec3",
    shade_triangle_id="vec3",
    shade_distance="vec3",
    shade_barycentric="vec3",
    shade_normal="vec3",
    shade_material_id="vec3",
)
class A1Renderer(ProgressiveRenderer):
    """Assignment 1: what did the eye ray hit? Six views of the hit (A1-15)."""

    name, what = "A1Renderer", "view"
    value_names = ("max_distance",)
    r, g, b = (factor / ID_COLOR_UNIT for factor in ID_COLOR)

    ShadeMode = IntEnum("ShadeMode", "HIT TRIANGLE_ID DISTANCE BARYCENTRIC NORMAL MATERIAL_ID")
    shade_mode = Mode("ShadeMode")

    @compile_time
    def radiance(self, scene, integrator, ray, hit, rng):
        """The colour from a replaced ``shade_ray``, a replaced method of the view in use, or the view itself."""
        own = f"shade_{integrator.name}"
        if "shade_ray" not in self.replaced and own in self.replaced:
            return call_with_known_args(getattr(self, own), hit)
        return ProgressiveRenderer.radiance(self, scene, integrator, ray, hit, rng)

    @property
    def max_distance(self) -> float:
        """The distance that the view "Distance" shows white; see ``surface_views.Distance``. It may be assigned."""
        view: Any = self._own(PARTS.find("integrator", "distance"))
        if not inside_kernel():
            view.prepare(self.scene_data, self.camera)
        return view.max_distance

    @max_distance.setter
    def max_distance(self, distance: float | None) -> None:
        view: Any = self._own(PARTS.find("integrator", "distance"))
        view.max_distance = distance

    @compile_time
    def _view(self, name: str, hit_data):
        view = self._own(PARTS.find("integrator", name))
        return view.radiance(self.scene_data.in_kernels(), None, hit_data, None)

    @ti.func
    def shade_hit(self, hit_data):
        """White for front faces, dark red for back faces, black for no hit."""
        return self._view("hit", hit_data)

    @ti.func
    def shade_triangle_id(self, hit_data):
        """A colour per triangle."""
        return self._view("triangle_id", hit_data)

    @ti.func
    def shade_distance(self, hit_data):
        """Black at the eye, white at ``max_distance`` and beyond."""
        return self._view("distance", hit_data)

    @ti.func
    def shade_barycentric(self, hit_data):
        """(u, v, w) as red, green, blue."""
        return self._view("barycentric", hit_data)

    @ti.func
    def shade_normal(self, hit_data):
        """[−1, 1] mapped to [0, 1], per axis."""
        return self._view("normal", hit_data)

    @ti.func
    def shade_material_id(self, hit_data):
        """A colour per material."""
        return self._view("material_id", hit_data)

    set_shade_hit = chooses("hit")
    set_shade_triangle_id = set_shade_triangle_ID = chooses("triangle_id")  # both are spellings of the handout
    set_shade_distance = chooses("distance")
    set_shade_barycentric = set_shade_barycentrics = chooses("barycentric")
    set_shade_normal = set_shade_normals = chooses("normal")
    set_shade_material_id = set_shade_material_ID = chooses("material_id")


@register
@overridable()
class A2Renderer(ProgressiveRenderer):
    """Assignment 2: direct illumination by the environment, with Monte Carlo estimators (A2-3, A2-9)."""

    name, what, jitters = "A2Renderer", "estimator", True
    asked = "uniform", "brdf"

    RAY_OFFSET = 1e-6  # of the course, for methods that read it; the package's own rays start as ``offset_origin`` says

    SampleMode = IntEnum("SampleMode", "UNIFORM BRDF MICROFACET")
    SamplingMode: type[IntEnum] = SampleMode
    sample_mode = Mode("SampleMode")

    set_sample_uniform = set_sample_uniform_sphere = chooses("uniform")
    set_sample_hemisphere = chooses("hemisphere")
    set_sample_brdf = chooses("brdf")
    set_sample_microfacet = chooses("microfacet")  # as brdf, where the roughness decides, and not Ns (A2-12)
    set_sample_environment = set_sample_light = chooses("environment")
    set_sample_mis = set_sample_mis_power = chooses("mis")
    set_sample_mis_balance = chooses("mis_balance")


@register
@overridable()
class A3Renderer(A2Renderer):
    """Assignment 3: direct illumination by surfaces that emit and by the environment (A3-1 … A3-5).

    It has the estimators of ``A2Renderer``, which sample lamps, too, where a scene has some, and begins with ``mis``.
    The estimator ``mis_one_sample`` has the weights ``mis_plight`` and ``mis_pbrdf``.
    """

    name, first = "A3Renderer", "mis"
    asked = "environment", "mis"
    value_names = tuple(usual_values(WEIGHTS))

    SampleMode = IntEnum("SampleMode", "UNIFORM BRDF LIGHT MIS")
    SamplingMode: type[IntEnum] = SampleMode

    mis_plight = Weight(
        "mis_plight",
        """The weight with which ``mis_one_sample`` samples the lights (A3-4).

        In ``mis_plight[None]``, the two weights add up to 1, as in the course: an assignment changes both. If the
        renderer uses "mis", which has no weights, it then uses "mis_one_sample".
        """,
    )
    mis_pbrdf = Weight("mis_pbrdf", "The weight with which ``mis_one_sample`` samples the BRDF, as ``mis_plight``.")

    @property
    def _one_sample(self) -> Any:
        """This renderer's copy of the integrator."""
        return self._own(PARTS.find("integrator", "mis_one_sample"))

    set_sample_mis_one_sample = chooses("mis_one_sample")  # one sample, drawn by lot (A3-4)


@register
@overridable()
class A4Renderer(PathValues, ProgressiveRenderer):
    """Assignment 4: paths, on which light bounces from surface to surface (A4-1 … A4-5).

    It begins with ``path``. ``max_bounces`` and the others may be set at any time; the picture then starts again.
    """

    name, what, first, jitters = "A4Renderer", "path", "path", True
    asked = "implicit", "explicit"
    value_names = tuple(DEFAULTS)

    ShadingMode = IntEnum("ShadingMode", "IMPLICIT EXPLICIT")
    shading_mode = Mode("ShadingMode")

    def use(self, integrator: IntegratorChoice) -> "Self":
        """Choose how light is found; the length of paths stays. Returns the renderer."""
        super().use(integrator)
        paths: Any = self.active
        paths.settings = self.path_settings
        return self

    def receipt(self) -> list[str]:
        """One line per effect and per form; then how many bounces are simulated, and whether roulette ends paths."""
        return [*super().receipt(), *self.path_settings.receipt()]

    def pictures_by_bounce(
        self, spp: int = 1, bounces: Sequence[int | Bounces] | None = None
    ) -> dict[int | Bounces, Picture]:
        """One picture for the light after each number of bounces; their sum is the picture of all of them (A4-5).

        Every picture is rendered with the same random numbers, and therefore of the same paths. They add up to the
        picture of ``spp`` samples but for rounding: in f32, to about 1e-7 of the brightest value. The paths of a
        picture end after the last bounce that counts in it. Afterwards, ``bounces`` is as before, and the next
        ``render`` starts the picture again.

        Args:
            spp: samples per pixel of each picture.
            bounces: what each picture counts: a number, or (first, last) as for the attribute ``bounces``. None gives
                a picture for each number from 0 to ``max_bounces``.

        Returns:
            The members of ``bounces`` with their pictures, in the same order.

        Raises:
            InputError: a number of bounces is named twice, or is more than ``max_bounces``; or the renderer is
                adaptive, so that each picture would take its samples in other pixels.
        """
        asked = list(range(self.max_bounces + 1)) if bounces is None else list(bounces)
        terms = [(one, one) if isinstance(one, int) else one for one in asked]
        check_terms(terms, self.max_bounces)
        if self.adaptive:
            raise InputError("pictures by bounce need the same samples in all of them: give adaptive=False")
        former, found = self.bounces, {}
        try:
            for one, term in zip(asked, terms, strict=True):
                self.bounces = term
                self.begin_anew()
                found[one] = self.render(spp).image()
        finally:
            self.bounces = former
            self.begin_anew()
        return found

    set_shading_implicit = chooses("implicit")  # paths find lights by chance (A4-1)
    set_shading_explicit = chooses("explicit")  # every surface takes a sample of the lights (A4-1)
    set_shading_mis = chooses("path")  # both, weighted by the power heuristic (A3-4, A4-1)


def __getattr__(name: str) -> Any:
    """``EnvISRenderer``, which only the course has."""
    if name == "EnvISRenderer":
        return import_quickly("taichi_tracer.course.geometry").EnvISRenderer
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
