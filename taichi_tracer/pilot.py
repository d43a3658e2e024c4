"""``use("auto")``: a pilot measures which estimator reaches an error soonest in this picture.

If n samples of an estimator take the time t and leave the error e, and the error falls as n^(−p), then the error E
needs the time t (e/E)^(1/p). It depends on the scene which estimator needs the least: samples of the lights cost less
than MIS and are as good where surfaces are matte; samples of the BRDF win where surfaces are glossy and light is even.
Nobody has to guess: the usual estimator begins the picture, and all are tried on a small copy of it. If another one
wins, the picture begins anew with it; otherwise it goes on.
"""

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from taichi_tracer.picture.error_estimate import RelativeError, percent
from taichi_tracer.picture.progress import Progress, Target, render_until

if TYPE_CHECKING:
    from taichi_tracer.progressive import ProgressiveRenderer

AUTO, PACKAGE = "auto", "taichi_tracer."
FIRST = 4  # samples of the usual estimator in the picture; they tell how long the rendering will take
SAMPLES, SMALLER = 16, 4  # of each estimator in the copy, whose sides are so much smaller: one sample of the picture
SHARE, COMPILING = 0.1, 0.5  # of the rendering: the most that the copies take, and the compilation for them
POWER = 0.7  # p: between 1/2, for independent samples, and 1
SMALLEST = 1e-6  # an error; where all samples are alike, that of the picture is 0
LARGER = 1.1  # another estimator is taken only if the usual one needs so much longer


class Trial(NamedTuple):
    """What the pilot measured of an estimator.

    Attributes:
        name: of the estimator. in_tiles: whether its samples are taken tile by tile.
        seconds: of one sample per pixel of the picture. error: after ``SAMPLES`` samples.
    """

    name: str
    in_tiles: bool
    seconds: float
    error: RelativeError

    def seconds_to(self, error: float) -> float:
        """Seconds of rendering until the picture has an error; ∞ if its own is unknown."""
        own = math.hypot(self.error, self.error.unseen)
        return (
            math.inf if math.isnan(own) or math.isnan(error) else self.seconds * SAMPLES * (own / error) ** (1 / POWER)
        )

    def error_after(self, seconds: float) -> float:
        """The error after some seconds of rendering."""
        own = math.hypot(self.error, self.error.unseen)
        return own * (self.seconds * SAMPLES / seconds) ** POWER


class Pilot:
    """The choice of an estimator for a renderer.

    Attributes:
        trials: what was measured, the best first. left_out: the names of estimators for which there was no time.
        wanted: the error to which the trials are compared.
        seconds, compile_seconds: what the pilot took.
    """

    def __init__(self) -> None:
        self.trials: list[Trial] = []
        self.left_out: list[str] = []
        self.wanted = math.nan
        self.seconds = self.compile_seconds = 0.0
        self._of: object = None

    def choose(self, renderer: "ProgressiveRenderer", target: Target) -> bool:
        """Let a renderer use the best of its estimators. If it is the usual one, the picture has its first samples.

        The choice holds until the scene, the camera or a value of the picture changes. Returns whether it was made now.
        """
        picture = renderer.state()[2:]
        if picture == self._of:
            return False
        same = [one for one in renderer.offers if not one.microfacets]  # others show other surfaces
        usual, *others = sorted(same, key=lambda one: rank(renderer, one))
        first = begin(renderer, usual.name, target)
        self.seconds, self.compile_seconds = first.seconds, first.compile_seconds
        copy = copy_of(renderer)
        trial = self.tried(copy, renderer, usual.name, target)
        faster = first.seconds_per_sample / trial.seconds  # or slower: a pixel of the picture, and of the copy
        self.trials = [trial._replace(seconds=first.seconds_per_sample)]
        whole = time_of(target, self.trials[0])
        ends = self.seconds + SHARE * whole, self.compile_seconds + COMPILING * whole
        self.left_out = [one.name for one in others]
        while self.left_out and self.seconds < ends[0] and self.compile_seconds < ends[1]:
            trial = self.tried(copy, renderer, self.left_out.pop(0), target)
            self.trials.append(trial._replace(seconds=trial.seconds * faster))
        reached = [one.error_after(whole) for one in self.trials]
        self.wanted = target.error or max(SMALLEST, min(reached, key=lambda e: math.inf if math.isnan(e) else e))
        self.trials.sort(key=lambda t: t.seconds_to(self.wanted) * (1.0 if t.name == usual.name else LARGER))
        if self.trials[0].name != usual.name or renderer.adaptive:
            use(renderer, self.trials[0].name)
            renderer.begin_anew()
        self._of = renderer.state()[2:]
        return True

    def tried(self, copy: "ProgressiveRenderer", renderer: "ProgressiveRenderer", name: str, target: Target) -> Trial:
        """Measure an estimator on the copy."""
        copy.use(name)
        copy.use_tiles = renderer.plan.will_take_tiles(copy.active, target)
        copy.render(SAMPLES)
        error = copy.error()
        self.seconds += copy.progress.seconds
        self.compile_seconds += copy.progress.compile_seconds
        return Trial(name, copy.plan.in_tiles, copy.progress.seconds_per_sample, error)

    def __str__(self) -> str:
        if not self.trials:
            return f"{AUTO}: nothing is rendered yet"
        best, *others = self.trials
        form = ", tiles" if best.in_tiles else ""
        words = [f"{best.name}{form}: {told(best.seconds_to(self.wanted))} to {percent(self.wanted)}"]
        words += [f"{one.name} {told(one.seconds_to(self.wanted))}" for one in others]
        if self.left_out:
            words.append(f"no time to try {', '.join(self.left_out)}")
        return f"{AUTO}: {'; '.join(words)}"


def rank(renderer: "ProgressiveRenderer", one: Any) -> tuple:
    """The order in which estimators are tried: the usual one, those of lights alone, of BRDFs, of both, of neither."""
    order = {(True, False): 0, (False, True): 1, (True, True): 2, (False, False): 3}
    return one.name != renderer.first, order[bool(one.samples_lights), bool(one.samples_brdf)]


def use(renderer: "ProgressiveRenderer", name: str) -> None:
    """Let a renderer use an estimator, and keep its pilot."""
    pilot = renderer.pilot
    renderer.use(name)
    renderer.pilot = pilot


def begin(renderer: "ProgressiveRenderer", name: str, target: Target) -> Progress:
    """Take the first samples of a picture, in the form that suits the target. Returns their progress."""
    pilot = renderer.pilot
    renderer.use(name)
    renderer.begin()
    renderer.plan.expect(target, False)
    try:
        render_until(renderer, Target(min(FIRST, target.spp or FIRST)))
    finally:
        renderer.pilot = pilot
    return renderer.progress


def copy_of(renderer: "ProgressiveRenderer") -> "ProgressiveRenderer":
    """A renderer of the same picture, with smaller sides, if its camera is one of the package."""
    camera = renderer.camera
    if type(camera).__module__.startswith(PACKAGE):
        view = {name: value for name, value in vars(camera.view).items() if value is not None}
        camera = type(camera)(*(max(1, side // SMALLER) for side in (renderer.width, renderer.height)), **view)
    copy = type(renderer)(
        renderer.scene_data,
        camera=camera,
        sampler=renderer.sampler,
        seed=renderer.seed,
        jitter=renderer.jitter,
        fast=renderer.fast,
    )
    for name, value in renderer.values().items():
        copy.change(name, value)
    return copy


def time_of(target: Target, usual: Trial) -> float:
    """The seconds of rendering until the first of the targets, with the usual estimator."""
    seconds = [usual.seconds_to(target.error)] if target.error else []
    seconds += [target.time] if target.time else []
    seconds += [usual.seconds * target.spp] if target.spp else []
    return min(seconds)


def told(seconds: float) -> str:
    """Seconds in two digits, without a power of ten."""
    if not math.isfinite(seconds):
        return "unknown"
    if seconds >= 3600:
        return f"{seconds / 3600:,.0f} h"
    return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.2g} s"
