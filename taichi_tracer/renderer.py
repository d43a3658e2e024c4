"""Progressive rendering: every call adds a sample per pixel, and any change starts over (A2-2)."""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer import surface_views
from taichi_tracer.camera import Camera
from taichi_tracer.errors import InputError, one_of
from taichi_tracer.film import Film
from taichi_tracer.primary_hits import PrimaryHits
from taichi_tracer.scene_data import SceneData


@ti.data_oriented
class ProgressiveRenderer:
    """A camera, a film and a choice among the things that the subclass ``offers``.

    Args:
        scene_data: the scene.
        width, height: pixels.
        camera: None makes one that shows the scene.
    """

    offers: tuple = ()  # what ``use`` can choose: objects with a name, a label and aliases
    srgb = False  # whether pictures are radiance, to be written with the sRGB transfer function (C-14)

    def __init_subclass__(cls, **options) -> None:
        """Give the subclass a setter ``set_shade_<name>`` for everything it offers."""
        super().__init_subclass__(**options)
        for choice in cls.offers:
            for name in (choice.name, *choice.aliases):
                setattr(cls, f"set_shade_{name}", _setter(choice))

    def __init__(
        self, scene_data: SceneData, width: int = 512, height: int = 512, camera: Camera | None = None
    ) -> None:
        scene_data.check_alive()
        self.scene_data = scene_data
        self.camera = Camera(width, height, **scene_data.view) if camera is None else camera
        self.width, self.height = self.camera.width, self.camera.height
        self.film = Film(self.width, self.height)
        self.hits = PrimaryHits(scene_data, self.camera)
        self.active = self.offers[0]
        self._shown = None  # what the samples on the film are of
        self._traced = None  # the camera version that ``hits`` belongs to

    @classmethod
    def names(cls) -> list[str]:
        """The names that ``use`` knows."""
        return [choice.name for choice in cls.offers]

    def use(self, name: str):
        """Choose what to render, by name; returns the renderer."""
        for choice in self.offers:
            if name in (choice.name, *choice.aliases):
                self.active = choice
                return self
        raise one_of("view", name, self.names())

    @property
    def samples(self) -> int:
        """Samples per pixel on the film."""
        return self.film.samples

    @property
    def canvas(self):
        """The Taichi field [x, y] of RGB vectors, y up: what ``ti.ui`` shows."""
        return self.film.canvas

    def reset(self) -> None:
        """Start over with the next ``render``."""
        self.film.reset()

    def render(self, spp: int = 1):
        """Add ``spp`` samples to every pixel; returns the renderer."""
        self.scene_data.check_alive()
        if int(spp) != spp or spp < 1:
            raise InputError(f"render: spp must be a whole number of at least 1, not {spp!r}")
        if not self.is_current():
            self.reset()
            self._shown = (self.active.name, self.camera.version)
        for _ in range(int(spp)):
            self.add_sample()
            self.film.samples += 1
        return self

    def is_current(self) -> bool:
        """Whether the samples on the film are of what the camera and the choice would show now."""
        return self._shown == (self.active.name, self.camera.version)

    def add_sample(self) -> None:
        """One sample for every pixel; a subclass says of what."""
        raise NotImplementedError(f"{type(self).__name__} must say what a sample is")

    def trace_primary_hits(self) -> None:
        """Bring ``hits`` up to date with the camera; a change of view alone needs no new rays."""
        if self._traced != self.camera.version:
            self.hits.trace()
            self._traced = self.camera.version

    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first; rendered first if no sample of it was taken."""
        self.scene_data.check_alive()
        if self.samples == 0 or not self.is_current():
            self.render()
        return self.film.image()

    def _repr_png_(self) -> bytes:
        """The picture so far, for notebooks."""
        from taichi_tracer.files.images import encode_png

        return encode_png(self.image(), srgb=self.srgb)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.active.name}, {self.width}×{self.height}, {self.samples} samples)"


def _setter(choice):
    def set_shade(self):
        return self.use(choice.name)

    set_shade.__doc__ = f"Show {choice.label}; the same as use({choice.name!r})."
    return set_shade


@ti.data_oriented
class A1Renderer(ProgressiveRenderer):
    """Assignment 1: what did the primary ray hit? Six views of it (A1-15)."""

    offers = surface_views.ALL

    def add_sample(self) -> None:
        """Every sample of a view through the pixel's centre is the picture itself."""
        self.trace_primary_hits()
        self._shade(self.active.color)

    @ti.kernel
    def _shade(self, color: ti.template()):
        for x, y in self.film.canvas:
            data = self.hits.hit_data(x, y)
            value = tm.vec3(0)
            if data.is_hit:
                value = color(data)
            self.film.put(x, y, value)
