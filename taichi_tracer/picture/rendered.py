"""What a renderer has of its picture: arrays, files, its error, and how bright it is shown."""

import functools
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_tracer.files.images import Picture, check_writable, encode_png, save_image
from taichi_tracer.picture import checkpoint
from taichi_tracer.picture.aovs import Aov, albedo_uv_of, as_channels, channel_names, find_aovs
from taichi_tracer.picture.denoised import Changed, clamped, denoised
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.picture.progress import ErrorPoint
from taichi_tracer.system import memory
from taichi_tracer.system.compile_time import one_at_a_time
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.importing import import_quickly
from taichi_tracer.system.parts import may_add
from taichi_tracer.system.stopwatch import ERROR, stage
from taichi_tracer.tones.base import Tone
from taichi_tracer.tones.display import Display, fitting_exposure

if TYPE_CHECKING:
    from typing_extensions import Self


GAMMA = 2.2  # of the course's windows
FIXED = {"scene_data", "camera", "width", "height", "jitter", "sampler", "first_sample"}  # once they are there


class RenderedPicture:
    """The base class of all renderers: the picture so far, and what is known about it.

    Attributes:
        film: the samples. shares: how often each pixel takes one.
        progress: of the present call of ``render``. seconds_before: of earlier calls for the same picture.
        error_curves: the name of an integrator → how the error of its last picture fell. A curve stays while another
            integrator shows the same, so that they can be compared; all end when the camera, the scene or the light
            changes.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        """Refuse another scene, camera or size: what was made for the present one would stay."""
        if name in FIXED and name in vars(self) and not may_add(self, sys._getframe(2)):
            raise InputError(f"the {name} of a renderer cannot be assigned: make a new renderer")
        super().__setattr__(name, value)

    def set_display(self, exposure: float | None = None, tone: str | Tone | None = None) -> "Self":
        """Choose how a picture of radiance is shown: in the window, in a notebook and in files of 8 bits.

        The samples, ``image()``, ``error()`` and floating-point files stay linear. Views of data are not changed.

        Args:
            exposure, tone: as for ``Display``; None leaves the setting as it is.
        """
        exposure = self.display.exposure if exposure is None else exposure
        self.display = Display(exposure, self.display.tone if tone is None else tone)
        return self

    def expose(self) -> "Self":
        """Choose the exposure that shows the picture well, in whole stops: see ``tones.display.fitting_exposure``."""
        return self.set_display(exposure=fitting_exposure(self.film.own_pixels(self.image())))

    @property
    def encoding(self) -> dict[str, Any]:
        """How ``save_image`` writes the picture: its arguments ``srgb``, ``exposure`` and ``tone``."""
        display = self.display if self.srgb else Display()
        return {"srgb": self.srgb, "exposure": display.exposure, "tone": display.tone}

    @property
    def samples(self) -> int:
        """Samples per pixel on the film; with adaptive sampling, the mean over all pixels."""
        return max(min(self.film.samples, 1), round(self.film.samples * self.shares.mean))

    @property
    def canvas(self) -> Any:
        """The Taichi field [x, y] of RGB vectors, with y up, that ``ti.ui`` shows."""
        self.film.show()
        return self.film.canvas

    @functools.cached_property
    def canvas_postprocessed(self) -> Any:
        """The Taichi field [x, y] of RGB vectors that ``postprocess`` writes, as ``canvas``."""
        self._memory_postprocessed, (shown,) = memory.filled(np.zeros((self.width, self.height, 3)), indices=2)
        return shown

    def postprocess(self) -> None:
        """Write ``canvas_postprocessed``: the picture with a power of 1/2.2, from 0 to 1, as the course shows it."""
        self.canvas_postprocessed.from_numpy(np.clip(self.canvas.to_numpy(), 0, 1) ** (1 / GAMMA))

    @property
    def non_finite(self) -> int:
        """How many samples were not finite and therefore not added; ``film.non_finite_samples`` lists them."""
        return self.film.non_finite

    @one_at_a_time
    def error(self) -> RelativeError:
        """Relative RMSE of the picture, estimated from its samples, with its 95 % interval; see ``error_estimate``."""
        with stage(ERROR, waits=True):
            self.find_rare_light()
            error = self.film.error()
        if error > 0:
            curve = self.error_curves.setdefault(self.active.name, [])
            if not curve or curve[-1].samples < self.samples:
                curve.append(ErrorPoint(self.samples, self.rendered_seconds, error))
        return error

    @property
    def rendered_seconds(self) -> float:
        """Seconds of rendering the samples of this picture, without compilation."""
        return self.seconds_before + self.progress.seconds

    @property
    def error_curve(self) -> list[ErrorPoint]:
        """How the error of this picture fell: (samples, seconds, error) of every look at it.

        ``error()`` looks, and so does ``render`` with a target of error, and after its first second with a target of
        time or with ``watch``. ``error_curves`` has the curves of all integrators that were tried, by name, until the
        camera, the scene or the light changes.
        """
        return self.error_curves.get(self.active.name, [])

    def error_image(self) -> np.ndarray:
        """(height, width, 3) float32, top row first: the standard error of every pixel; NaN if it is unknown.

        With the low-discrepancy sampler, the value of a pixel comes from a single difference and is rough. Means over
        regions of many pixels are reliable.
        """
        return self.film.standard_error().astype(np.float32)

    def denoised(self) -> Changed:
        """What Open Image Denoise (the extra ``denoise``) makes of the picture of light, and the error of that.

        The sampler must have two independent halves of samples: "niederreiter_two" or "sobol".
        """
        return denoised(self)

    def clamped(self, factor: float) -> Changed:
        """The picture of light without fireflies, and the error of that; the sampler as for ``denoised``.

        Args:
            factor: a pixel that is brighter than so many times the brightest of its eight neighbours is cut to that.
        """
        return clamped(self, factor)

    @one_at_a_time
    def image(self) -> Picture:
        """(height, width, 3) float32, linear, top row first. If there is no sample of it yet, one is rendered.

        The array knows whether it is light (``srgb``), so that ``save_image`` writes it as ``save`` does.
        """
        self.scene_data.check_alive()
        if self.samples == 0 or not self.is_current():
            self.render()
        return Picture(self.film.image(), self.srgb)

    @one_at_a_time
    def aov(self, name: str) -> np.ndarray:
        """A raw array: what the rays through the centres of the pixels hit, whatever the picture shows.

        Args:
            name: "distance", (height, width), from the eye, infinite for a miss; "position" and "normal",
                (height, width, 3) in world space, and "barycentric", (height, width, 2), the weights (u, v) of the
                second and the third vertex: NaN for a miss; "triangle_id" and "material_id", (height, width), −1 for a
                miss; "uv", (height, width, 2), where textures are looked up, 0 in a scene without textures, and
                "albedo", (height, width, 3), linear Kd with its texture: NaN for a miss.

        Returns:
            The array in the layout of ``image()``: top row first. Ids are int32, the others have the running precision.
        """
        aovs = find_aovs(name)
        return self._raw_arrays(aovs)[aovs[0]]

    def _raw_arrays(self, aovs: Sequence[Aov]) -> dict[Aov, np.ndarray]:
        """AOV → (height, width, …): what the rays through the centres of all pixels hit."""
        if not aovs:
            return {}
        y, x = np.mgrid[self.height - 1 : -1 : -1, : self.width]
        hits = self.scene_data.intersect(*self.camera.rays(x, y))
        looks = albedo_uv_of(self.scene_data.in_kernels(), hits) if any(aov.is_look for aov in aovs) else None
        rows = {aov: aov.of(hits, looks) for aov in aovs}
        return {aov: found.reshape(self.height, self.width, *found.shape[1:]) for aov, found in rows.items()}

    def save(self, path: str | Path, aovs: Sequence[str] = ()) -> None:
        """Write the picture so far in the format of the path's extension; it is rendered first if it has no sample.

        Only the crop is written. In 8-bit formats, radiance gets the exposure and the tone curve of ``set_display`` and
        the sRGB transfer function, and data does not (C-14).

        Args:
            aovs: names of raw arrays, see ``aov``, that an EXR file has beside the picture as channels of float32:
                Z for the distance, N.X, N.Y, N.Z for the normal, P.X … for the position, triangle_id, material_id,
                barycentric.u and barycentric.v, uv.u and uv.v, albedo.R ….
        """
        check_writable(path, channel_names(find_aovs(aovs)))
        channels = self.channels(aovs)  # first, because the picture may take hours
        save_image(path, self.film.own_pixels(self.image()), channels=channels, **self.encoding)

    def channels(self, aovs: Sequence[str]) -> dict[str, np.ndarray]:
        """Name → (height, width) array of the crop, for each channel that some AOVs have in an EXR file."""
        found: dict[str, np.ndarray] = {}
        for aov, values in self._raw_arrays(find_aovs(aovs)).items():
            found |= as_channels(aov, self.film.own_pixels(values))
        return found

    def explain(self, column: int, row: int, sample: int | None = 0, samples: int | None = None) -> Any:
        """Every number on the way from a pixel to its colour, for one of its samples; see ``explain``.

        The parts of this picture compute the pixel's samples once more, so that the numbers are those of the picture:
        ``explanation.mean`` is ``image()[row, column]``, to the last bit, if the samples are those of ``render``.

        Args:
            column, row: the pixel, counted from the left and from the top.
            sample: which of its samples, counted from 0; None is the one that is farthest from their mean.
            samples: how many samples the pixel has; None takes as many as the picture has.

        Raises:
            InputError: the picture has no such pixel, or the pixel no such sample.
        """
        return import_quickly("taichi_tracer.explain.pixel").explained(self, column, row, sample, samples)

    def facts(self) -> dict[str, Any]:
        """Everything that the bits of the picture depend on, for checkpoints; see ``picture.checkpoint``."""
        return checkpoint.facts_of(self)

    def save_checkpoint(self, path: str | Path) -> None:
        """Write the samples into a file, so that ``load_checkpoint`` can continue the picture later."""
        checkpoint.save(self, path)

    def load_checkpoint(self, path: str | Path) -> None:
        """Continue from a checkpoint: ``render`` then adds the samples that come next.

        Raises:
            InputError: the file is damaged, or its samples belong to another picture. The renderer has not changed.
        """
        checkpoint.load(self, path)

    def _repr_png_(self) -> bytes:
        """The picture so far, for notebooks."""
        return encode_png(self.image(), self.srgb, self.display if self.srgb else Display())
