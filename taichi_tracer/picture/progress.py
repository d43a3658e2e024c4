"""When a rendering ends: at a number of samples, after a time, or at an error; and a prediction of the end."""

import math
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import taichi as ti

from taichi_tracer.picture.adaptive import adapt, begins_again
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.picture.own_parts import note_numbers
from taichi_tracer.system import compiling
from taichi_tracer.system.errors import InputError

FIRST_ERROR = 8  # samples per pixel before an estimated error may end the rendering; fewer could miss some light
# Seconds of rendering before the first estimate, if no target depends on it: less is over before anybody has read it.
LOOKS_AFTER = 1.0
COST_OF_LOOKING = 0.02  # the fraction of the time that estimates of the error may take, if no target depends on them
# If the error is a target: the smallest and the largest number of new samples before the next estimate, as a fraction
# of the samples so far.
STEPS = 0.02, 0.25
# The prediction of the error uses the estimates from this fraction of the samples on; earlier ones are too rough.
FIT_FROM = 1 / 8
FIT_SPAN = 3  # the factor between the first and the last number of samples that a fitted slope needs at least
# The error may decrease faster than 1/√n. The prediction assumes that this fraction of the additional slope will last.
CAUTION = 0.8
MOST_EXTRA_SLOPE = 0.5  # beyond the 1/2 of 1/√n; a larger value comes from the noise of the estimates
RECENT = 16  # the number of passes over which the time of a sample is measured
MOST_SAMPLES = 2**32 - 1  # of a pixel: their indices have 32 bits
AT_ONCE = 0.1  # seconds of passes in one launch of a kernel, at most


@dataclass(frozen=True)
class Target:
    """The targets of a rendering. It ends when the first of them is reached; None is no target.

    Attributes:
        spp: the number of samples per pixel to add.
        time: seconds of rendering, without compilation.
        error: relative RMSE as a fraction: 0.02 is 2 %. It is reached when the upper end of the interval of the
            estimate is not larger: an estimate that is too small by chance must not end the rendering.
        is_usual: whether nobody has asked for these targets.
    """

    spp: int | None = None
    time: float | None = None
    error: float | None = None
    is_usual: bool = field(default=False, compare=False)

    def __post_init__(self) -> None:
        for name in ("spp", "time", "error"):
            value = getattr(self, name)
            is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
            if value is not None and not (is_number and 0 < value < math.inf):
                raise InputError(f"render: {name} must be a number above 0, not {value!r}")
        if self.error is not None and self.error > 1:
            raise InputError(f"render: error is a fraction, {self.error / 100:g} for {self.error:g} %, and at most 1")
        if self.spp is not None and (int(self.spp) != self.spp or self.spp > MOST_SAMPLES):
            raise InputError(f"render: spp must be a whole number from 1 to {MOST_SAMPLES:,}, not {self.spp!r}")

    @classmethod
    def of(cls, spp: int | None = None, time: float | None = None, error: float | None = None) -> "Target":
        """The targets that were given, or one sample per pixel."""
        return cls(1 if spp is None and time is None and error is None else spp, time, error)


@dataclass(repr=False)
class Progress:
    """The progress of a rendering.

    Attributes:
        target: the targets that end the rendering.
        samples: the number of samples per pixel, on average.
        pilot: the ``Progress`` of what was rendered before, of an adaptive picture.
        error: the last estimate of the error; NaN before the first estimate.
        looks: (samples, relative error) of each estimate.
        place: where it is rendered, in words; "" for this process.
        seconds: of rendering and of estimating the error, with those of the pilot, without compilation.
        compile_seconds: in which kernels were read, translated or loaded, and their machine code was made.
    """

    target: Target
    samples: float = 0
    pilot: Any = None
    error: RelativeError = RelativeError(math.nan)
    looks: list[tuple[float, float]] = field(default_factory=list)
    place: str = ""
    seconds: float = 0.0
    compile_seconds: float = 0.0
    _recent: list[float] = field(default_factory=list)
    _of_pass: float = 1
    _look_seconds: float = 0.0
    _next_look: float = 2

    def __post_init__(self) -> None:
        if self.pilot is not None:
            self.seconds, self.compile_seconds = self.pilot.seconds, self.pilot.compile_seconds

    def __repr__(self) -> str:
        seconds = f"{self.seconds:.2f} s of rendering, {self.compile_seconds:.2f} s of compiling"
        return f"Progress({self.samples:g} samples, {seconds}, error {self.error})"

    def took(self, seconds: float, samples: float = 1, on_kernels: float = 0.0, passes: int = 1) -> None:
        """Record one more pass over all pixels, or several at once.

        Args:
            seconds: the time of the passes, without that of their kernels.
            samples: the number of samples that a pixel took in a pass, on average.
            on_kernels: seconds in which kernels were read, and translated or loaded.
            passes: how many passes these were.
        """
        for _ in range(passes):  # rounded in every pass, so that it does not matter how many are rendered at once
            self.samples += samples
        self.seconds += seconds
        self.compile_seconds += on_kernels
        self._recent = [*self._recent[1 - RECENT :], seconds / (passes * samples)]
        self._of_pass = samples

    @property
    def seconds_per_sample(self) -> float:
        """The median time of the last passes, without compilation, for one sample of every pixel on average."""
        return float(np.median(self._recent)) if self._recent else math.nan

    def passes_until_a_look(self, most: int) -> int:
        """How many passes to take until somebody looks: at most so many, and those that are left until a target."""
        if most == 1 or not self._recent:
            return 1
        seconds = self._of_pass * self.seconds_per_sample
        until = self._samples_until()
        if self.target.error is not None:
            until["error"] = self._next_look - self.samples
        return max(1, int(min(most, AT_ONCE / seconds, *(left / self._of_pass for left in until.values()))))

    def look(self, estimate) -> None:
        """Estimate the error with ``estimate()``, if an estimate is due; near the target, it is due more often."""
        n = self.samples
        if n < self._next_look or (self.target.error is None and self.seconds < LOOKS_AFTER):
            return
        start, on_kernels = perf_counter(), compiling.seconds_spent()
        self.error = estimate()
        on_kernels = compiling.seconds_spent() - on_kernels
        seconds = perf_counter() - start - on_kernels
        self.seconds += seconds
        self.compile_seconds += on_kernels
        self._look_seconds += seconds
        self.looks.append((n, float(self.error)))
        if self.target.error is not None:
            least, most = STEPS
            later = max(1, least * n, min(most * n, self.samples_left))  # most * n, if the latter is NaN
            self._next_look = n + (n if n < FIRST_ERROR else later)  # 2, 4, 8 samples show how the error falls
        else:
            cost = self._look_seconds / len(self.looks)
            self._next_look = n + max(1, cost / (COST_OF_LOOKING * self.seconds_per_sample))

    @property
    def has_reached_error(self) -> bool:
        """Whether the target of the error is reached; False if there is none."""
        target = self.target.error
        return target is not None and self.samples >= FIRST_ERROR and bool(self.error.high <= target)

    @property
    def is_done(self) -> bool:
        """Whether one of the targets is reached. The time is reached if one more pass would miss it by more."""
        target = self.target
        if (target.spp is not None and self.samples >= target.spp) or self.has_reached_error:
            return True
        if target.time is None or not self._recent:
            return False
        return self.seconds + self._of_pass * self.seconds_per_sample / 2 > target.time

    def _samples_until(self) -> dict[str, float]:
        """Target → the predicted number of samples until it is reached; NaN if no prediction is possible."""
        target, found = self.target, {}
        if target.spp is not None:
            found["spp"] = target.spp - self.samples
        if target.time is not None:
            found["time"] = (target.time - self.seconds) / self.seconds_per_sample
        if target.error is not None:
            found["error"] = self.samples_left
        return found

    @property
    def seconds_left(self) -> float:
        """The predicted time until the first target is reached; NaN if no prediction is possible."""
        return float(np.maximum(0.0, soonest(self._samples_until()) * self.seconds_per_sample))

    @property
    def samples_to_come(self) -> float:
        """The predicted number of samples until the first target is reached.

        NaN if that is unknown, or if only the number of samples is a target: then nothing else shall change it.
        """
        found = self._samples_until()
        return math.nan if list(found) == ["spp"] else soonest(found)

    @property
    def samples_left(self) -> float:
        """The predicted number of samples until the error target, if the error decreases as a power of their number."""
        now = [(n, e) for n, e in self.looks if n >= FIT_FROM * self.samples and e > 0]
        if self.target.error is None or self.samples < FIRST_ERROR or not now:
            return math.nan
        n, error = now[-1]
        power = 0.5  # 1/√n, the error of independent samples
        if n >= FIT_SPAN * now[0][0]:
            samples, errors = np.log(now).T
            slope, _ = np.polyfit(samples, errors, 1)
            power += CAUTION * min(max(-slope - power, 0.0), MOST_EXTRA_SLOPE)
        return n * (max(error, self.error.high) / self.target.error) ** (1 / power) - self.samples


def soonest(until: dict[str, float]) -> float:
    """The smallest number; NaN if one is NaN, or if there is none."""
    return float(np.min(list(until.values()) or [math.nan]))


def render_until(renderer, target: Target, watch=None) -> None:
    """Add samples to a renderer's film until the first of the targets is reached.

    Args:
        renderer: a ``renderer.ProgressiveRenderer``; its ``progress`` is updated.
        watch: a function that is called with the progress after each pass over all pixels.
    """
    renderer.progress = progress = Progress(target)
    if not renderer.is_current():
        renderer.begin()
        if renderer.adaptive:
            renderer.progress = progress = Progress(target, pilot=adapt(renderer))
    looks = target.error is not None or target.time is not None or watch is not None
    while not progress.is_done:
        start, on_kernels = perf_counter(), compiling.seconds_spent()
        passes = progress.passes_until_a_look(renderer.passes_at_once)
        first = renderer.first_sample + renderer.film.samples
        renderer.add_range(first, first + passes)
        if looks:
            ti.sync()
        renderer.film.samples += passes
        on_kernels = compiling.seconds_spent() - on_kernels
        seconds = max(0.0, perf_counter() - start - on_kernels)
        progress.took(seconds, renderer.shares.mean, on_kernels, passes)
        if looks and renderer.is_random:
            progress.look(renderer.error)
        if not renderer.is_random and (target.error is not None or target.time is not None):
            break
        if renderer.film.samples == 1:
            note_numbers(renderer)
        if watch is not None:
            watch(progress)
        if not progress.is_done and begins_again(renderer, progress):
            renderer.progress = progress = Progress(target, pilot=progress)


# ── the curve of the error ──


class ErrorPoint(NamedTuple):
    """One look at the error.

    Attributes:
        samples: per pixel. seconds: of rendering, without compilation.
        error: relative RMSE, a fraction.
    """

    samples: int
    seconds: float
    error: RelativeError
