"""When to stop: at a number of samples, after a time, or at an error; and when that will be."""

import math
import statistics
from dataclasses import dataclass, field
from time import perf_counter

import taichi as ti

from taichi_tracer.picture.adaptive import adapt
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.system.errors import InputError

FIRST_ERROR = 8  # samples per pixel before an estimated error may end the rendering: fewer can miss what there is
COST_OF_LOOKING = 0.02  # of the time: how much of it estimating the error may take where nothing depends on it
STEPS = 0.02, 0.25  # smallest and largest share of the samples so far, before the next estimate, where something does
CAUTION = 0.8  # of what the error falls faster than 1/√n so far: how much of it will last


@dataclass
class Target:
    """What ends the rendering: whichever is reached first; None does not.

    Attributes:
        spp: samples per pixel, to be added.
        time: seconds of rendering, without compilation.
        error: relative RMSE, a fraction: 0.02 is 2 %.
    """

    spp: int | None = None
    time: float | None = None
    error: float | None = None

    def __post_init__(self) -> None:
        if self.spp is not None and (int(self.spp) != self.spp or self.spp < 1):
            raise InputError(f"render: spp must be a whole number of at least 1, not {self.spp!r}")
        for name in ("time", "error"):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise InputError(f"render: {name} must be more than 0, not {value!r}")


@dataclass
class Progress:
    """How far a rendering is. Times are in seconds; those of single samples tell compilation from rendering.

    Attributes:
        target: what ends it.
        samples: per pixel, on average.
        pilot: of samples that were taken before, and are not in the picture.
        error: estimated last; unknown before.
        looks: (samples, relative error) whenever it was estimated.
    """

    target: Target
    samples: float = 0
    pilot: "Progress | None" = None
    error: RelativeError = field(default_factory=lambda: RelativeError(math.nan, math.nan, math.nan))
    looks: list[tuple[int, float]] = field(default_factory=list)
    _compiling: list[float] = field(default_factory=list)
    _later: float = 0.0
    _recent: list[float] = field(default_factory=list)
    _look_seconds: float = 0.0
    _first_look: float = 0.0
    _next_look: float = 2

    def took(self, seconds: float, samples: float = 1, compiles: bool = False) -> None:
        """One more pass over all pixels was made.

        Args:
            seconds: that it took.
            samples: of each pixel on average.
            compiles: whether kernels may have been compiled meanwhile.
        """
        self.samples += samples
        if compiles:
            self._compiling.append(seconds)
        else:
            self._later += seconds
            self._recent = [*self._recent[-15:], seconds]

    @property
    def seconds_per_sample(self) -> float:
        """Of late, without compilation."""
        return statistics.median(self._recent) if self._recent else min(self._compiling, default=math.nan)

    @property
    def compile_seconds(self) -> float:
        """What the passes that compiled took beyond the others; 0 as long as there are no others to compare with."""
        before = 0.0 if self.pilot is None else self.pilot.compile_seconds
        if not self._recent:
            return before
        return before + self._first_look + sum(max(0.0, s - self.seconds_per_sample) for s in self._compiling)

    @property
    def seconds(self) -> float:
        """Of rendering, and of estimating the error; without compilation."""
        spent = sum(self._compiling) + self._first_look + self._later + self._look_seconds
        if self.pilot is not None:
            spent += self.pilot.seconds + self.pilot.compile_seconds
        return spent - self.compile_seconds

    def look(self, estimate) -> None:
        """Estimate the error, by ``estimate()``, when it is time to: more often, the nearer the target is."""
        n = self.samples
        if n < self._next_look:
            return
        start = perf_counter()
        self.error = estimate()
        seconds = perf_counter() - start
        if self.looks:
            self._look_seconds += seconds
        else:
            self._first_look = seconds  # compiles
        self.looks.append((n, float(self.error)))
        if self.target.error is not None:
            least, most = STEPS
            left = self.samples_left
            self._next_look = n + max(1, least * n, min(most * n, most * n if math.isnan(left) else left))
        else:
            cost = self._look_seconds / max(1, len(self.looks) - 1)
            self._next_look = n + max(1, cost / (COST_OF_LOOKING * self.seconds_per_sample))

    @property
    def is_done(self) -> bool:
        """Whether one of the targets is reached; of the time, whether one more sample would miss it by more."""
        target = self.target
        if target.spp is not None and self.samples >= target.spp:
            return True
        if target.error is not None and self.samples >= FIRST_ERROR and self.error <= target.error:
            return True
        if target.time is None or not self._recent:
            return False
        return self.seconds + self.seconds_per_sample / 2 > target.time

    @property
    def seconds_left(self) -> float:
        """Predicted seconds of rendering until the first target is reached; NaN where nothing can be said."""
        left = []
        if self.target.spp is not None:
            left.append((self.target.spp - self.samples) * self.seconds_per_sample)
        if self.target.time is not None:
            left.append(self.target.time - self.seconds)
        if self.target.error is not None:
            left.append(self.samples_left * self.seconds_per_sample)
        if any(math.isnan(seconds) for seconds in left):
            return math.nan
        return max(0.0, min(left, default=math.nan))

    @property
    def samples_left(self) -> float:
        """Predicted samples until the error is the target's, if it goes on falling as a power of their number."""
        now = [(n, e) for n, e in self.looks if n >= self.samples / 8 and e > 0]
        if self.samples < FIRST_ERROR or not now:
            return math.nan
        n, error = now[-1]
        power = 0.5
        if n >= 3 * now[0][0]:
            power += CAUTION * min(max(-slope(now) - power, 0.0), 0.5)
        return n * (error / self.target.error) ** (1 / power) - self.samples


def slope(points: list[tuple[float, float]]) -> float:
    """Of the straight line through the points, on logarithms, by least squares."""
    x, y = [math.log(p[0]) for p in points], [math.log(p[1]) for p in points]
    centre = statistics.fmean(x)
    return sum((a - centre) * b for a, b in zip(x, y, strict=True)) / sum((a - centre) ** 2 for a in x)


def render_until(renderer, target: Target, watch=None) -> None:
    """Add samples to a renderer's film until the first of the targets is reached.

    Args:
        renderer: a ``renderer.ProgressiveRenderer``; its ``progress`` tells how far it is.
        watch: called with the progress after every sample of every pixel.
    """
    renderer.progress = progress = Progress(target)
    if not renderer.is_current():
        renderer.begin()
        if renderer.adaptive:
            progress.pilot = adapt(renderer)
            renderer.progress = progress
    looks = target.error is not None or watch is not None
    while not progress.is_done:
        start, forms = perf_counter(), renderer.eye_rays.forms
        renderer.add_sample(renderer.first_sample + renderer.film.samples)
        if target.time is not None or looks:
            ti.sync()
        renderer.film.samples += 1
        compiles = progress.samples == 0 or renderer.eye_rays.forms != forms
        progress.took(perf_counter() - start, renderer.shares.mean, compiles)
        if looks and renderer.is_random:
            progress.look(renderer.error)
        if not renderer.is_random and (target.error is not None or target.time is not None):
            break
        if watch is not None:
            watch(progress)
