"""``MapRenderer``: pictures of the work that other pictures take; see ``integrators.work``."""

import copy
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import taichi as ti

from taichi_tracer.files.images import Picture
from taichi_tracer.integrators.base import Control, Integrator
from taichi_tracer.integrators.path_settings import DEFAULTS
from taichi_tracer.integrators.paths import Paths
from taichi_tracer.integrators.scene_in_kernels import SceneInKernels
from taichi_tracer.integrators.work import WorkMap, counted
from taichi_tracer.options import RENDERER_DEFAULTS, RendererOptions, with_options
from taichi_tracer.picture.sample_parts import SampleParts
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer_parts import PathValues
from taichi_tracer.scene_data import KEPT_FORMS, SceneData
from taichi_tracer.settings import OPTIONS
from taichi_tracer.system.errors import one_of
from taichi_tracer.system.memory import recent
from taichi_tracer.system.parts import PARTS, overridable, register
from taichi_tracer.tones.display import Display
from taichi_tracer.tones.heat import HEAT, Scale, round_up

if TYPE_CHECKING:
    from typing_extensions import Unpack

MEASURED = "view", "estimator", "path"  # kinds of integrators that can be measured
COVERED = 99.5  # percent of the pixels that the automatic scale covers


@register
@ti.data_oriented
@overridable()
class MapRenderer(PathValues, ProgressiveRenderer):
    """Maps of work: nodes and triangles per pixel, shadow rays blocked, directions below the horizon, standard error.

    Args:
        scene_data, width, height, options: as for ``ProgressiveRenderer``; ``integrator`` is a map.
        of: the name of the integrator that is measured. It may be assigned later; the picture then starts again.

    ``image()`` has the numbers. Windows and files of 8 bits show them as heat: black is 0, and white is the end of
    ``scale``, a round number that covers the picture unless ``set_display`` chose an exposure.
    """

    name, what, jitters, has_own_display = "MapRenderer", "map", True, True
    value_names = "of", *DEFAULTS

    @with_options(RendererOptions, RENDERER_DEFAULTS)
    def __init__(
        self,
        scene_data: SceneData,
        width: int = 512,
        height: int = 512,
        *,
        of: str = OPTIONS["map_of"].usual,
        **options: "Unpack[RendererOptions]",
    ) -> None:
        self._chosen_display: Display | None = None
        self._measured: dict[str, Integrator] = {}
        self._of = find_measured(of)
        self._scale_of: tuple = ()
        self._parts: dict[Any, SampleParts] = {}
        super().__init__(scene_data, width, height, **options)

    # ── what is measured ──

    @property
    def of(self) -> str:
        """The name of the integrator that is measured."""
        return self._of

    @of.setter
    def of(self, name: str) -> None:
        self._of = find_measured(name)

    @property
    def map(self) -> WorkMap:
        """The map in use."""
        return cast(WorkMap, self.active)

    @property
    def explained(self) -> Integrator:
        """The integrator that is measured, and whose samples ``explain`` explains: this renderer's copy."""
        if self._of not in self._measured:
            self._measured[self._of] = copy.copy(PARTS.find("integrator", self._of))
        found = self._measured[self._of]
        if isinstance(found, Paths):
            found.settings = self.path_settings
        return found

    def controls(self) -> tuple[Control, ...]:
        """What is measured, and the values of that."""
        return Control("of", self.of, names=names_of_measured()), *super().controls()

    def state(self) -> tuple:
        """Everything that the picture depends on."""
        return (*super().state(), self._of, self.explained.version)

    def begin(self) -> None:
        """Start the picture again."""
        self.explained.prepare(self.scene_data, self.camera)
        super().begin()

    @property
    def shows_light(self) -> bool:
        """A map is not of light."""
        return False

    # ── samples ──

    def sample_parts(self, scene: SceneInKernels, integrator: Integrator) -> SampleParts:
        """What a sample of the measured picture is made of; the map in use counts what it does, or leaves it."""
        parts, number = super().sample_parts(scene, self.explained), self.map.number
        if number is None:
            return parts
        return recent(self._parts, KEPT_FORMS, (number, self.explained, scene), lambda: counted(parts, number))

    # ── the picture ──

    def image(self) -> Picture:
        """(height, width, 3) float32, top row first: the number of each pixel, in all channels."""
        found = super().image()
        if self.map.number is not None:
            return found
        errors = np.nan_to_num(self.error_image().mean(axis=2, keepdims=True), posinf=0.0)
        return Picture(np.repeat(errors, 3, axis=2), self.srgb)

    @property
    def canvas(self) -> Any:
        """The Taichi field [x, y] that windows show: the numbers of ``image()``."""
        field = super().canvas
        if self.map.number is None:
            field.from_numpy(np.ascontiguousarray(self.image()[::-1].swapaxes(0, 1)))
        return field

    @property
    def display(self) -> Display:
        """How windows and files of 8 bits show the numbers: as heat; if no exposure was chosen, it fits the picture."""
        if self._chosen_display is not None:
            return self._chosen_display
        of = self.film.samples, self._shown, self.active.name
        if self._scale_of[:1] != (of,):
            values = self.film.own_pixels(self.image())[..., 0] if self.film.samples > 0 else np.zeros(1)
            high = round_up(float(np.percentile(values, COVERED)) or float(values.max()))
            self._scale_of = of, Display(-float(np.log2(high)), HEAT)
        return self._scale_of[1]

    @display.setter
    def display(self, display: Display) -> None:
        self._chosen_display = None if display.exposure == 0 else Display(display.exposure, HEAT)

    @property
    def scale(self) -> Scale:  # type: ignore[override]
        """What the colours mean."""
        return Scale(1 / self.display.scale, f"{self.map.unit}, of {self.of}")

    def notes(self) -> list[str]:
        """What the colours mean, for the command line."""
        return [
            f"{self.active.name} ({self.scale.text}): white is {self.scale.high:.3g} (--exposure sets another scale)",
        ]

    def facts(self) -> dict[str, Any]:
        """Everything that the bits of the picture depend on."""
        return {**super().facts(), "map_of": self.of, **self.explained.facts()}


def find_measured(name: str) -> str:
    """The name of an integrator that can be measured.

    Raises:
        InputError: there is none of this name.
    """
    found = PARTS.find("integrator", name)
    if found.what not in MEASURED:
        raise one_of("map of", name, names_of_measured())
    return found.name


def names_of_measured() -> list[str]:
    """The names of the integrators that can be measured."""
    return [part.name for part in PARTS.all("integrator") if part.what in MEASURED]
