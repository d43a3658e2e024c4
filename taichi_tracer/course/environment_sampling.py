"""``EnvISRenderer`` of the course: where samples of an environment fall, as counts in a picture of it (A3-6)."""

from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.integrators.modes import Mode
from taichi_tracer.lights.environment_light import EnvironmentLight
from taichi_tracer.samplers.independent import IndependentSampler
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system.course_fields import held
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.memory import filled


@ti.data_oriented
class EnvISRenderer:
    """Counts the samples of a scene's environment in each pixel of a picture of it.

    Args:
        scene_data: a scene with an environment. width, height: size of the picture in pixels.

    Attributes:
        background: field [x, y] of RGB vectors, with y up: the environment, after ``render_background``.
        count_map: field [x, y]: how many samples fell into each pixel.
        samples: how many there are in all.
    """

    class SampleMode(Mode):
        """How points of the image are drawn: all with one density, or in proportion to their light."""

        UNIFORM = 1, "uniform"
        ENVMAP = 2, "envmap"

    def __init__(self, width: int, height: int, scene_data: SceneData, seed: int = 0) -> None:
        if scene_data.environment is None:
            raise InputError("EnvISRenderer needs a scene with an environment, such as environment='studio'")
        self.scene_data, self.environment, self.width, self.height = scene_data, scene_data.environment, width, height
        self.light = EnvironmentLight(self.environment, scene_data.effects)
        self.light.prepare()
        self.sampler = IndependentSampler()
        self.seed, self.samples, self.mode = seed, 0, self.SampleMode.UNIFORM
        zeros = np.zeros((width, height, 3))
        self._memory, (self.background, self.count_map) = filled(zeros, zeros[..., 0], indices=2)

    @property
    def sample_mode(self) -> Any:
        """The mode, as ``sample_mode[None]``."""
        return held(int(self.mode), self._use)

    def _use(self, mode: int) -> None:
        self.mode = self.SampleMode(mode)
        self.reset()

    def set_sample_uniform(self) -> None:
        """Draw points of the image with one density; the counts begin again."""
        self._use(self.SampleMode.UNIFORM)

    def set_sample_envmap(self) -> None:
        """Draw points in proportion to the light that arrives from them; the counts begin again."""
        self._use(self.SampleMode.ENVMAP)

    def reset(self) -> None:
        """Begin to count again."""
        self._memory.write(self.count_map, np.zeros((self.width, self.height)))
        self.samples = 0

    def render_background(self) -> None:
        """Write the environment into ``background``."""
        x, y = np.arange(self.width), np.arange(self.height)
        columns = ((x + 0.5) / self.width * self.environment.x_resolution).astype(int)
        rows = ((1 - (y + 0.5) / self.height) * self.environment.y_resolution).astype(int)
        radiance = self.environment.pixels[rows[None], columns[:, None]] * self.environment.intensity
        self._memory.write(self.background, radiance)

    def sample_env(self, samples: int = 1) -> None:
        """Add so many samples to ``count_map``."""
        if not samples >= 1:
            raise InputError(f"EnvISRenderer: samples must be at least 1, not {samples!r}")
        self._count(int(samples), self.samples, self.seed, self.mode == self.SampleMode.ENVMAP)
        self.samples += int(samples)

    @ti.kernel
    def _count(self, samples: ti.i32, first: ti.u32, seed: ti.u32, follows_light: ti.template()):
        for i in range(samples):
            xi = self.sampler.start(seed, 0, 0, first + ti.cast(i, ti.u32)).next_2d()
            u, v = xi.x, xi.y
            if ti.static(follows_light):
                u, v = self.importance_sample_envmap(xi)
            x = ti.min(ti.cast(u * self.width, ti.i32), self.width - 1)
            y = ti.min(ti.cast(v * self.height, ti.i32), self.height - 1)
            self.count_map[x, y] += 1

    @ti.func
    def importance_sample_envmap(self, xi):
        """(u, v) in [0, 1)² of a point of the image, with v up."""
        _, _, u, height = self.light.find_texel(xi)
        u -= self.environment.settings[1]  # the rotation of the environment, which the image does not have
        return u, 0.5 + tm.asin(tm.clamp(height, -1, 1)) / tm.pi
