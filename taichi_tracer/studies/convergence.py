"""Error against seconds: the ways to render a picture, over several seeds, against a reference of known error."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import taichi as ti

from taichi_tracer.fast.primary_hits import LARGE_PICTURE
from taichi_tracer.picture.adaptive import PILOT
from taichi_tracer.picture.error_estimate import RelativeError, relative_error
from taichi_tracer.picture.progress import slope
from taichi_tracer.renderer import A2Renderer, A4Renderer, ProgressiveRenderer
from taichi_tracer.studies.machine import describe_machine
from taichi_tracer.studies.metrics import flip, rel_mse, relative_rmse
from taichi_tracer.studies.variants import Source, Variant, renderer_of
from taichi_tracer.system.errors import InputError

TARGETS = (0.10, 0.05, 0.02, 0.01)  # relative RMSE
REFERENCE_SEED = 1_000_003
REFERENCE_SHARE, PICTURE_SHARE = 0.2, 0.006  # of the budget: for the reference, and for each picture at equal time
FURTHER_REFERENCE = 0.25  # of the share of the first: what every other one gets, since few variants need it
SHORTEST_REFERENCE = 0.2  # seconds: with fewer samples the error of the reference could not be estimated
STEEPEST = -0.75  # slope that is continued beyond what was measured: what Owen's scrambling promises in general
FLATTEST = -0.1  # slope of a curve that hardly falls: it is not continued, since its end would be anywhere
FARTHEST = 300  # times the seconds that were measured: no curve is continued beyond
FEW_POINTS = 4  # of a curve with fewer, the slope is that of all; of others, that of the later half
REFERENCE_LAMPS = "hierarchy"  # of the reference, where choices of lamps are compared: it has the least noise
WARM_UP = 3  # samples: after them everything is compiled
GLARE = 50  # times the mean of the picture: pixels above it, such as a sun in a mirror, would alone decide its error
CLEAR = 1.5  # times the reference's own error: below it, the error of a picture cannot be told from that
FEWEST, FIRST_SAMPLES, MOST_SAMPLES = 3, 2, 1 << 16  # pictures of a curve; samples per pixel of its first and last


@dataclass
class Curve:
    """What one variant reached.

    Attributes:
        compile_seconds: until everything was compiled, beyond the time of rendering.
        samples: (K,) per pixel, at which the picture was compared.
        seconds, errors: (seeds, K) of rendering; relative RMSE against the reference, the reference's own taken off.
            NaN where the reference is no better.
        noise: (seeds, K) the relative error that each picture tells of itself: what light it leaves out is not in it.
        reference_mean: without the pixels that glare.
        shift, shift_error: the mean of the pictures minus that of the reference, as a fraction of the latter, and the
            standard error of this fraction; without the pixels that glare.
        is_biased: whether the variant leaves out light that is in the reference.
        image, image_error, image_flip, image_rel_mse: at equal time; None for variants without one.
    """

    variant: Variant
    compile_seconds: float
    samples: np.ndarray
    seconds: np.ndarray
    errors: np.ndarray
    noise: np.ndarray
    reference_mean: float
    shift: float
    shift_error: float
    is_biased: bool = False
    image: np.ndarray | None = None
    image_samples: int = 0
    image_error: float = math.nan
    image_flip: float = math.nan
    image_rel_mse: float = math.nan

    @property
    def mean_seconds(self) -> np.ndarray:
        """(K,) over the seeds."""
        return self.seconds.mean(axis=0)

    @property
    def mean_errors(self) -> np.ndarray:
        """(K,) root of the mean square over the seeds; NaN where one is not known."""
        return np.sqrt((self.errors**2).mean(axis=0))

    @property
    def milliseconds_per_sample(self) -> float:
        """Of every pixel."""
        return 1e3 * float(self.mean_seconds[-1] / self.samples[-1])

    @property
    def bias(self) -> float:
        """z-score of the mean of the pictures against that of the reference."""
        return self.shift / self.shift_error if self.shift_error > 0 else 0.0

    @property
    def slope(self) -> float:
        """Of error against seconds on logarithms, over the later half: −1/2 for independent samples."""
        points = self._known()
        later = points[len(points) // 2 :] if len(points) >= FEW_POINTS else points
        return slope(later) if len(later) >= 2 else math.nan

    def _known(self) -> list[tuple[float, float]]:
        pairs = zip(self.mean_seconds.tolist(), self.mean_errors.tolist(), strict=True)
        return [(s, e) for s, e in pairs if e > 0]

    def seconds_to(self, target: float) -> tuple[float, bool]:
        """(seconds to a relative error, whether that was measured).

        Beyond the last picture the slope is continued; NaN where that would be too far, or where the error is to a part
        light that was left out, which no further sample adds.
        """
        points = self._known()
        if not points:
            return math.nan, False
        for (s0, e0), (s1, e1) in zip(points, points[1:], strict=False):
            if e0 >= target >= e1 and e0 > e1:
                share = math.log(e0 / target) / math.log(e0 / e1)
                return s0 * (s1 / s0) ** share, True
        if points[0][1] <= target:
            return points[0][0], True
        power = max(self.slope, STEEPEST)
        if self.is_biased or not power < FLATTEST:
            return math.nan, False
        factor = (points[-1][1] / target) ** (-1 / power)
        return (points[-1][0] * factor if factor <= FARTHEST else math.nan), False

    @property
    def variance_times_time(self) -> float:
        """Mean square error × seconds at the end: smaller is better, and with 1/√n the same at any time."""
        points = self._known()
        return math.nan if not points else (points[-1][1] * self.reference_mean) ** 2 * points[-1][0]


@dataclass
class Study:
    """Everything that was measured.

    Attributes:
        reference_error: as the reference's own samples tell it.
        equal_seconds: of rendering, of the pictures that are shown beside each other.
        reference_bounces: how many surfaces reflect in the reference at most; None for direct light.
        notes: what was not compared, and why.
    """

    scene: str
    size: tuple[int, int]
    machine: str
    seeds: int
    equal_seconds: float
    curves: list[Curve] = field(default_factory=list)
    references: dict[str, np.ndarray] = field(default_factory=dict)
    reference_error: RelativeError | None = None
    reference_samples: int = 0
    seconds: float = 0.0
    reference_bounces: int | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def glaring(self) -> int:
        """How many pixels are in no error."""
        return int((~without_glare(self.reference)).sum())

    @property
    def reference(self) -> np.ndarray:
        """(h, w, 3) what the first variant is compared with."""
        return next(iter(self.references.values()))


@dataclass
class Truth:
    """A reference: the picture, its relative error without the pixels that glare, and the variance of its pixels.

    The renderer is kept because Taichi forgets every compiled kernel when a field is freed.
    """

    image: np.ndarray
    error: RelativeError
    variance: np.ndarray
    samples: int
    renderer: ProgressiveRenderer | None

    @property
    def counted(self) -> np.ndarray:
        """(h, w) bool: the pixels that errors are of, all but those that glare."""
        return without_glare(self.image)

    @property
    def mean(self) -> float:
        """Of the pixels that errors are of."""
        return float(self.image[self.counted].mean())

    def error_of(self, image: np.ndarray) -> float:
        """Relative RMSE of a picture."""
        return relative_rmse(image[self.counted], self.image[self.counted])

    def noise_of(self, renderer: ProgressiveRenderer) -> float:
        """What a picture tells of its own error, without the pixels that glare: a fraction of the reference's mean."""
        variance, groups = renderer.film.spread()
        known = self.counted & (groups > 1)
        if not known.any():
            return math.nan
        return math.sqrt(variance[known].mean()) / self.mean


def measure(
    source: Source,
    variants: list[Variant],
    size: tuple[int, int] = (128, 128),
    budget: float = 60.0,
    seeds: int = 3,
    arch: str = "auto",
    tell: Callable[[str, float], None] = lambda what, done: None,
) -> Study:
    """Render every variant within the budget.

    Args:
        budget: seconds in all, compilation included. A variant that compiles for longer than its share still gets
            a few samples.
        tell: called with what is being done, and the share of the budget that is spent.

    Raises:
        InputError: the scene has no light, or what is to be compared cannot be compared with it.
    """
    source.check(variants)
    start = time.perf_counter()
    study = Study("", size, "", seeds, budget * PICTURE_SHARE)
    most = max(v.max_bounces for v in variants)
    study.reference_bounces = most if variants[0].is_path else None
    truths: dict[str, Truth] = {}
    done = 0
    # variants of one precision together, since each change starts Taichi anew; the first one's come first
    for mode in dict.fromkeys((v.precision, v.fast_math) for v in variants):
        group = [v for v in variants if (v.precision, v.fast_math) == mode]
        source.start(group[0], arch)
        study.machine = describe_machine()
        runs, scenes, renderers = [], {}, {}
        if not study.scene:
            scenes[group[0].scene] = first_scene = source.load(group[0])
            study.scene = source.title(first_scene)
            variants, study.notes = comparable(variants, first_scene)
            group = [v for v in group if v in variants]
        for variant in group:
            if variant.scene not in scenes:
                scenes[variant.scene] = source.load(variant)
            scene = scenes[variant.scene]
            if variant.lookup not in truths:
                tell("reference", (time.perf_counter() - start) / budget)
                share = REFERENCE_SHARE * (FURTHER_REFERENCE if truths else 1)
                own = reference_variant(variant, variants)
                if own.scene not in scenes:
                    scenes[own.scene] = source.load(own)
                truths[variant.lookup] = reference_of(scenes[own.scene], own, size, share * budget)
            tell(f"{variant.label}: compiling", (time.perf_counter() - start) / budget)
            truth = scaled(truths[variant.lookup], variant.scale)
            key = (*variant.scene, variant.sampler, variant.adaptive, variant.scale)
            if key not in renderers:  # one for all estimators: what the eye rays hit is compiled once
                kind = renderer_of(variant.estimator)
                renderers[key] = make(kind, scene, variant, truth.image.shape[1::-1])
            runs.append(Run(renderers[key], variant, truth))
        for seed in range(seeds):  # all variants in turn, so that what else the machine does meets all alike
            for i, run in enumerate(runs):
                tell(f"{run.variant.label}: seed {seed + 1}", (time.perf_counter() - start) / budget)
                left = budget - (time.perf_counter() - start)
                left *= len(group) / (len(variants) - done)  # the share of this group
                left -= study.equal_seconds * len(runs)
                run.render(1 + seed, left / (len(runs) * (seeds - seed) - i))
        study.curves += [run.curve(seeds + 1, study.equal_seconds) for run in runs]
        done += len(group)
    first = truths[variants[0].lookup]
    for curve in study.curves:
        curve.is_biased = curve.variant.is_path and curve.variant.max_bounces < most
    study.curves.sort(key=lambda c: variants.index(c.variant))
    study.references = {lookup: truth.image for lookup, truth in truths.items()}
    study.reference_error, study.reference_samples = first.error, first.samples
    study.seconds = time.perf_counter() - start
    return study


def comparable(variants: list[Variant], scene) -> tuple[list[Variant], list[str]]:
    """The variants that differ in a scene, and notes on those that do not.

    Raises:
        InputError: choices of lamps are compared, and the scene has no lamps.
    """
    if len({v.lamp_choice for v in variants}) > 1 and scene.lamps.count == 0:
        raise InputError(f"accuracy: {scene.source} has no surface with Ke > 0, so that no lamp is chosen")
    notes = []
    if scene.environment is None and len({v.lookup for v in variants}) > 1:
        variants = [v for v in variants if v.lookup == variants[0].lookup]
        notes.append("The scene has no environment, so that its look-up was not compared.")
    return variants, notes


def reference_variant(variant: Variant, variants: list[Variant]) -> Variant:
    """What the reference of a variant is rendered with: the package's own parts, whatever is compared with them."""
    choices = {v.lamp_choice for v in variants}
    own = Variant(
        estimator="path" if variant.is_path else "mis",
        lamp_choice=variant.lamp_choice if len(choices) == 1 else REFERENCE_LAMPS,
        max_bounces=max(v.max_bounces for v in variants),
    )
    of_scene = ("lookup", "triangle_test", "intersector", "plain")
    return replace(own, **{knob: getattr(variant, knob) for knob in of_scene})


def reference_of(scene, variant: Variant, size: tuple[int, int], seconds: float) -> Truth:
    """A picture by multiple importance sampling, for that many seconds, and how far it is off."""
    renderer = make(A4Renderer if variant.is_path else A2Renderer, scene, variant, size)
    renderer.seed = REFERENCE_SEED
    renderer.render(time=max(seconds, SHORTEST_REFERENCE))
    image, (variance, groups) = renderer.image().astype(np.float64), renderer.film.spread()
    error = relative_error(variance, np.where(without_glare(image), groups, 0), image)
    if math.isnan(error):
        raise InputError(
            f"accuracy: no light of {scene.source} reaches the camera, so that there is no error to measure"
        )
    return Truth(image, error, variance, renderer.samples, renderer)


def without_glare(image: np.ndarray) -> np.ndarray:
    """(h, w) bool: pixels that are no more than ``GLARE`` times as bright as the picture."""
    return image.max(axis=2) <= GLARE * image.mean()


def scaled(truth: Truth, scale: float) -> Truth:
    """The reference for a picture of fewer pixels: the means of blocks of its pixels."""
    if scale == 1:
        return truth
    n = round(1 / scale)
    height, width = (s // n for s in truth.image.shape[:2])

    def blocks(values):
        return values[: height * n, : width * n].reshape(height, n, width, n, 3).mean(axis=(1, 3))

    image, variance = blocks(truth.image), blocks(truth.variance) / n**2
    error = truth.error * math.sqrt(variance.mean() / truth.variance.mean()) if truth.error > 0 else truth.error
    return replace(truth, image=image, error=RelativeError(error, error, error), variance=variance)


def make(
    renderer_class: type[ProgressiveRenderer], scene, variant: Variant, size: tuple[int, int]
) -> ProgressiveRenderer:
    """A renderer of a variant; it never compiles another form of the eye rays in the middle of a measurement."""
    width, height = size
    renderer = renderer_class(scene, width, height, sampler=variant.sampler, adaptive=variant.adaptive)
    renderer.eye_rays.use_packets = renderer.eye_rays.can_use_packets and width * height >= LARGE_PICTURE
    return as_variant(renderer, variant)


def as_variant(renderer: ProgressiveRenderer, variant: Variant) -> ProgressiveRenderer:
    """The renderer, with the estimator of a variant, and with the length of its paths."""
    if isinstance(renderer, A4Renderer):
        renderer.path_settings.set(**variant.paths)
    return renderer.use(variant.estimator)


class Run:
    """The measurement of one variant, seed by seed; it is compiled when it is made."""

    def __init__(self, renderer: ProgressiveRenderer, variant: Variant, truth: Truth) -> None:
        self.variant, self.truth, self.renderer = variant, truth, renderer
        self.begin(0)
        renderer.render(WARM_UP, watch=lambda _: None)
        self.compile_seconds = self.renderer.progress.compile_seconds
        self.samples: list[int] = []
        self.seconds: list[list[float]] = []
        self.errors: list[list[float]] = []
        self.noise: list[list[float]] = []
        self.finals: list[tuple[np.ndarray, np.ndarray]] = []

    def begin(self, seed: int) -> None:
        """Start over with other random numbers."""
        self.renderer.seed = seed
        as_variant(self.renderer, self.variant).begin_anew()

    def render(self, seed: int, slot: float) -> None:
        """Compare pictures of one seed, each with twice as many samples per pixel as the one before.

        Args:
            slot: seconds that the first seed may take. The other seeds take as many samples as that one.
        """
        renderer, spent, done, seconds, errors, noise = self.renderer, 0.0, 0, [], [], []
        self.begin(seed)
        is_first, first = not self.samples, PILOT if self.variant.adaptive else FIRST_SAMPLES
        for wanted in doubled(first) if is_first else list(self.samples):
            if is_first and len(errors) >= FEWEST and 2 * spent >= slot:
                break
            begin = time.perf_counter()
            renderer.render(wanted - done)
            ti.sync()
            spent, done = spent + time.perf_counter() - begin, wanted
            seconds.append(spent)
            errors.append(error_beyond(self.truth.error_of(renderer.image()), self.truth.error))
            noise.append(self.truth.noise_of(renderer))
            if is_first:
                self.samples.append(wanted)
        self.seconds.append(seconds)
        self.errors.append(errors)
        self.noise.append(noise)
        self.finals.append((renderer.image().astype(np.float64), renderer.film.variance_of_mean()))

    def curve(self, seed: int, equal_seconds: float) -> Curve:
        """What was measured, and a picture of its own at equal time."""
        curve = Curve(
            self.variant,
            self.compile_seconds,
            np.array(self.samples),
            np.array(self.seconds),
            np.array(self.errors),
            np.array(self.noise),
            self.truth.mean,
            *shift(self.finals, self.truth),
        )
        if self.variant.scale == 1:
            self.begin(seed)
            image = self.renderer.render(time=equal_seconds).image()
            curve.image, curve.image_samples = image, self.renderer.samples
            curve.image_error = self.truth.error_of(image)
            curve.image_rel_mse, curve.image_flip = rel_mse(image, self.truth.image), flip(image, self.truth.image)[0]
        return curve


def doubled(first: int) -> list[int]:
    """``first``, and each time twice as many, up to ``MOST_SAMPLES``."""
    return [first << k for k in range(MOST_SAMPLES.bit_length()) if first << k <= MOST_SAMPLES]


def error_beyond(measured: float, reference: float) -> float:
    """The error of a picture from its difference to a reference that errs too; NaN where the reference is no better."""
    if not measured > CLEAR * reference:
        return 0.0 if measured == 0 else math.nan
    return math.sqrt(measured**2 - reference**2)


def shift(finals: list[tuple[np.ndarray, np.ndarray]], truth: Truth) -> tuple[float, float]:
    """(mean of pictures minus that of the reference, its standard error), both as fractions of the reference's mean.

    Args:
        finals: (picture, variance of its pixels) for every seed.
    """
    difference = np.mean([p for p, _ in finals], axis=0) - truth.image
    variance = np.sum([np.nan_to_num(v) for _, v in finals], axis=0) / len(finals) ** 2 + np.nan_to_num(truth.variance)
    spread = variance[truth.counted].sum(axis=1) / 3  # channels err together
    return float(difference[truth.counted].mean()) / truth.mean, math.sqrt(spread.mean() / spread.size) / truth.mean
