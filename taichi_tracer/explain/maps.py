"""``MapRenderer``: pictures of the work that other pictures take; see ``integrators.work``."""

import copy
import functools
import time
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.files.images import Picture
from taichi_tracer.integrators.base import Control, Integrator, NameControl
from taichi_tracer.integrators.path_settings import DEFAULTS, PathSettings
from taichi_tracer.integrators.paths import Paths
from taichi_tracer.integrators.work import WorkMap, counted
from taichi_tracer.options import RENDERER_DEFAULTS, RendererOptions, with_options
from taichi_tracer.picture.sample_parts import SampleParts
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.scene_data import KEPT_FORMS, SceneData
from taichi_tracer.settings import OPTIONS
from taichi_tracer.system.errors import one_of
from taichi_tracer.system.memory import Lru
from taichi_tracer.system.parts import PARTS, overridable, register
from taichi_tracer.system.some_pixels import SomePixels
from taichi_tracer.tones.display import Display
from taichi_tracer.tones.heat import HEAT, Scale, round_up

if TYPE_CHECKING:
    from typing_extensions import Unpack

USUALLY_MEASURED: str = OPTIONS["map_of"].usual  # what is measured when nobody says it
MEASURED = "view", "estimator", "path"  # kinds of integrators that can be measured
COVERED = 99.5  # percent of the pixels that the automatic scale covers
TILES, SMALLEST_TILE = 4096, 8  # of a picture that is timed: at most so many tiles, of at least so many pixels a side


@register
@ti.data_oriented
@overridable()
class MapRenderer(ProgressiveRenderer):
    """Maps of work: nodes and triangles per pixel, shadow rays blocked, standard error, seconds.

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
        of: str = USUALLY_MEASURED,
        **options: "Unpack[RendererOptions]",
    ) -> None:
        self._chosen_display: Display | None = None
        self._measured: dict[str, Integrator] = {}
        self._of = find_measured(of)
        self._scale_of: tuple = ()
        self._parts = Lru(KEPT_FORMS)
        super().__init__(scene_data, width, height, **options)

    # ── what is measured ──

    @functools.cached_property
    def path_settings(self) -> PathSettings:
        """How long the paths are that are measured."""
        return PathSettings()

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
    def measured(self) -> Integrator:
        """The integrator that is measured: this renderer's copy."""
        if self._of not in self._measured:
            self._measured[self._of] = copy.copy(PARTS.find("integrator", self._of))
        found = self._measured[self._of]
        if isinstance(found, Paths):
            found.settings = self.path_settings
        return found

    @property
    def explained(self) -> Integrator:
        """What ``explain`` explains: the sample that is measured."""
        return self.measured

    @property
    def needs_light(self) -> bool:
        """Whether what is measured shows nothing in a scene without light."""
        return self.measured.needs_light

    def values(self) -> dict[str, Any]:
        """What is measured, and how long its paths are."""
        return {"of": self.of, **self.path_settings.facts()}

    def controls(self) -> tuple[Control, ...]:
        """What is measured, and its own values."""
        return NameControl("of", self.of, names_of_measured()), *self.measured.controls()

    def change(self, name: str, value: Any) -> None:
        """Change a value of ``controls``."""
        if name in DEFAULTS:
            self.path_settings.set(**{name: value})
        elif name == "of":
            self.of = value
        else:
            self.measured.change(name, value)

    def state(self) -> tuple:
        """Everything that the picture depends on."""
        return (*super().state(), self._of, self.measured.version)

    def begin(self) -> None:
        """Start the picture again."""
        self.measured.prepare(self.scene_data, self.camera)
        super().begin()

    @property
    def shows_light(self) -> bool:
        """A map is not of light."""
        return False

    # ── samples ──

    def add_sample(self, index: int, count: int = 1) -> None:
        """Take samples for every pixel, and count what they do."""
        scene = self.kernel_scene()
        scene.lights.prepare(self.measured.samples_lights)
        key = self.map, self.measured, scene
        parts = self._parts.get(key, lambda: self._watched(self.sample_parts(scene, self.measured)))
        if self.map.is_timed:
            for k in range(index, index + count):
                self._add_times(self.seconds_of_tiles(parts, k), k)
        else:
            self._take_samples(parts, self.seed, index, count)

    def _watched(self, parts: SampleParts) -> SampleParts:
        """The parts of a sample as the map in use watches them."""
        if self.map.is_timed:
            return parts._replace(film=self._tile)
        return parts if self.map.number is None else counted(parts, self.map.number)

    @functools.cached_property
    def _tile(self) -> SomePixels:
        """The tile that is timed."""
        return SomePixels(in_order=True)

    def seconds_of_tiles(self, parts: SampleParts, index: int) -> np.ndarray:
        """(tiles across, tiles upwards) seconds that a sample of a pixel takes on one core, as the mean of a tile.

        A kernel has no clock. Therefore the tiles are rendered one after the other, each by one thread, and the time
        that it takes to start a kernel is subtracted.
        """
        side = self.side_of_tiles
        times = np.zeros((-(-self.width // side), -(-self.height // side)), np.float32)

        def seconds(x0: int, x1: int, y0: int, y1: int) -> float:
            """How long a sample of each pixel of one tile takes together."""
            self._tile.choose((x0, x1), (y0, y1))
            begin = time.perf_counter()
            self._take_samples(parts, self.seed, index, 1)
            ti.sync()
            return time.perf_counter() - begin

        empty = min(seconds(0, 0, 0, 0) for _ in range(9))
        (left, right), (bottom, top) = self.film.ranges
        for i, j in np.ndindex(*times.shape):
            x0, x1 = max(left, i * side), min(right, (i + 1) * side)
            y0, y1 = max(bottom, j * side), min(top, (j + 1) * side)
            if x0 < x1 and y0 < y1:
                needed = min(seconds(x0, x1, y0, y1) for _ in range(2))  # another program may run in between
                times[i, j] = max(0.0, needed - empty) / ((x1 - x0) * (y1 - y0))
        return times

    @property
    def side_of_tiles(self) -> int:
        """Pixels on a side of the tiles that are timed."""
        return max(SMALLEST_TILE, int(np.ceil(np.sqrt(self.width * self.height / TILES))))

    @ti.kernel
    def _add_times(self, times: ti.types.ndarray(dtype=ti.f32, ndim=2), index: ti.u32):
        for x, y in ti.ndrange(*self.film.ranges):
            seconds = times[x // ti.static(self.side_of_tiles), y // ti.static(self.side_of_tiles)]
            self.film.add(x, y, tm.vec3(ti.cast(seconds, float)), index)

    # ── the picture ──

    def image(self) -> Picture:
        """(height, width, 3) float32, top row first: the number of each pixel, in all channels."""
        found = super().image()
        if not self.map.shows_error:
            return found
        errors = np.nan_to_num(self.film.standard_error().mean(axis=2, keepdims=True), posinf=0.0)
        return Picture(np.repeat(errors, 3, axis=2), self.srgb)

    @property
    def canvas(self) -> Any:
        """The Taichi field [x, y] that windows show: the numbers of ``image()``."""
        field = super().canvas
        if self.map.shows_error:
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
        return [f"{self.active.name}: white is {self.scale.high:.3g} {self.scale.text} (--exposure sets another scale)"]

    def facts(self) -> dict[str, Any]:
        """Everything that the bits of the picture depend on."""
        return {**super().facts(), "map_of": self.of, **self.measured.facts()}


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
