"""Do claims of errors hold where light is hard to find? On scenes that had no part in choosing anything.

python -m benchmarks.claims cells [SCENE ...]
    Every estimator of A3 and A4, at 1, 3 and 8 bounces, 16 and 64 samples; and pictures that are adaptive or cropped. A
    cell fails if fewer than 90 % of its renders hold the truth, or if more than 1 % are wrong by more than twice: a
    render that says "unknown" is not wrong.
python -m benchmarks.claims stops [SCENE ...]
    Renderings to an error of 5 and 2 %: does one end although its true error is larger?
python -m benchmarks.claims pictures [FILE.png]
    Four claims that samples alone would get wrong, each with its picture above the true one.
"""

import math
import sys
from dataclasses import dataclass

import numpy as np
from PIL import Image

import taichi_tracer as tt
from benchmarks.claim_scenes import SCENES
from benchmarks.helper import describe_machine
from taichi_tracer.picture.metrics import relative_rmse

SIZE, SPP, RENDERS = 48, (16, 64), 100
CROP = (11, 40, 8, 43)  # pixels
REFERENCE_SPP, REFERENCE_SEED = 8192, 10**6
LEAST_INSIDE, MOST_WRONG = 0.9, 0.01
TARGETS, STOPS, SECONDS = (0.05, 0.02), 4, 2.0


@dataclass(frozen=True)
class Way:
    """How pictures are made.

    Attributes:
        estimator: its name. bounces: of paths; 0 for direct light.
        how: "adaptive", "crop", or an empty text for neither.
    """

    estimator: str
    bounces: int = 0
    how: str = ""

    def __str__(self) -> str:
        bounces = f"{self.bounces} bounces" if self.bounces else ""
        return ", ".join(word for word in (self.estimator, bounces, self.how) if word)

    def renderer(self, scene: tt.SceneData, seed: int = 0, **options):
        """A renderer of direct light, or of paths."""
        options |= {"adaptive": True} if self.how == "adaptive" else {}
        options |= {"crop": CROP} if self.how == "crop" else {}
        if self.bounces == 0:
            return tt.A3Renderer(scene, SIZE, SIZE, seed=seed, **options).use(self.estimator)
        renderer = tt.A4Renderer(scene, SIZE, SIZE, seed=seed, **options).use(self.estimator)
        renderer.active.change("max_bounces", self.bounces)
        return renderer


DIRECT = tuple(Way(name) for name in ("mis", "environment", "brdf"))
PATHS = tuple(Way("path", n) for n in (1, 3, 8)) + (Way("explicit", 3), Way("implicit", 3))
OTHERS = tuple(Way(*of, how) for of in (("mis", 0), ("path", 3)) for how in ("adaptive", "crop"))
SHOWN = (  # with their seeds
    ("small_in_view", Way("mis"), 1),
    ("above_glass", Way("path", 8), 2),
    ("indirect", Way("implicit", 3), 0),
    ("plates", Way("brdf"), 0),
)
PICTURE, BRIGHTNESS, COLOURS, LARGER = "docs/images/unseen_light.png", 0.25, 64, 4
TO_AN_ERROR = (Way("mis"), Way("brdf"), Way("path", 3), Way("path", 8))


class References:
    """The references of a scene: of direct light, and of paths by their bounces."""

    def __init__(self, scene: tt.SceneData) -> None:
        self.scene, self.found = scene, {}

    def of(self, way: Way) -> tuple[np.ndarray, float]:
        """(h, w, 3) the picture, and its relative error as far as it is known."""
        if way.bounces not in self.found:
            renderer = Way("path" if way.bounces else "mis", way.bounces).renderer(self.scene, REFERENCE_SEED)
            error = float(renderer.render(REFERENCE_SPP).error())
            self.found[way.bounces] = renderer.image().astype(np.float64), error if math.isfinite(error) else 1.0
        return self.found[way.bounces]


@dataclass
class Cell:
    """The errors of many renders of one cell: (n,) arrays of what was stated and of the truth.

    ``reference`` is the error of the reference. What is smaller than twice this error cannot be judged: in a room whose
    samples are all alike, a picture is more exact than its reference.
    """

    stated: np.ndarray
    low: np.ndarray
    high: np.ndarray
    true: np.ndarray
    reference: float

    @property
    def is_inside(self) -> np.ndarray:
        """Whether the interval contains the truth; a render that says "unknown" is not wrong."""
        return ~(self.true > np.hypot(self.high, 2 * self.reference)) & ~(self.true < self.low - 2 * self.reference)

    @property
    def width(self) -> float:
        """The median of the upper end over the truth."""
        judged = self.true > 2 * self.reference
        return float(np.nanmedian(self.high[judged] / self.true[judged])) if judged.any() else math.nan

    @property
    def wrong(self) -> float:
        """The share of renders in which the truth is more than twice the upper end."""
        return float((self.true > np.hypot(2 * self.high, 2 * self.reference)).mean())


def own_pixels(renderer, picture: np.ndarray) -> np.ndarray:
    """The pixels that a renderer renders."""
    return renderer.film.own_pixels(picture).astype(np.float64)


def cells_of(way: Way, scene: tt.SceneData, references: References) -> list[Cell]:
    """A cell for each of ``SPP``; their pictures have the same seeds."""
    (truth, error), renderer = references.of(way), way.renderer(scene)
    rows: list[list[tuple]] = [[] for _ in SPP]
    for seed in range(RENDERS):
        renderer.seed = seed
        renderer.begin_anew()
        for row, samples in zip(rows, SPP, strict=True):
            stated = renderer.render(samples - renderer.samples).error()
            true = relative_rmse(own_pixels(renderer, renderer.image()), own_pixels(renderer, truth))
            row.append((float(stated), stated.low, stated.high, true))
    return [Cell(*np.array(row).T, error) for row in rows]


def cells(names: list[str]) -> None:
    """Print a row for each two cells, those of 16 and of 64 samples, and how many fail."""
    print(f"\n{SIZE}², {RENDERS} renders of every cell, references with {REFERENCE_SPP:,} samples\n")
    columns = "scene", "estimator", "holds", "wrong by 2 ×", "unknown", "upper end / true", "true", "reference", "fail"
    print(f"with {SPP[0]} and with {SPP[1]} samples per pixel\n")
    print(f"| {' | '.join(columns)} |\n|---|---|{'--:|' * 7}", flush=True)
    failed, widths = 0, []
    for name in names:
        scene = SCENES[name]()
        references = References(scene)
        for way in (*DIRECT, *PATHS, *OTHERS):
            found = cells_of(way, scene, references)
            fails = sum(bool(one.is_inside.mean() < LEAST_INSIDE or one.wrong > MOST_WRONG) for one in found)
            failed += fails
            widths += [one.width for one in found]
            numbers = [f"{one.is_inside.mean():.0%}" for one in found], [f"{one.wrong:.0%}" for one in found]
            numbers += [f"{np.isnan(one.stated).sum()}" for one in found], [f"{one.width:.2f}" for one in found]
            numbers += ([f"{np.median(one.true):.1%}" for one in found],)
            text = " | ".join(", ".join(pair) for pair in numbers)
            print(f"| {name} | {way} | {text} | {found[0].reference:.1%} | {fails or ''} |", flush=True)
    print(f"\n{failed} of {len(widths)} cells fail. Upper end / true, median of the cells: {np.nanmedian(widths):.2f}.")


def stops(names: list[str]) -> None:
    """Print how many renderings to an error end, and how many of these too early."""
    print(f"\n{SIZE}², {STOPS} seeds, at most {SECONDS} s each\n")
    print("| scene | estimator | error | ended | true error is larger | more than twice |\n|---|---|--:|--:|--:|--:|")
    count = np.zeros(4, int)
    for name in names:
        scene = SCENES[name]()
        references = References(scene)
        for way in TO_AN_ERROR:
            truth, of_truth = references.of(way)
            renderer = way.renderer(scene)
            for target in TARGETS:
                row = np.zeros(4, int)
                for seed in range(STOPS):
                    renderer.seed = seed
                    renderer.begin_anew()
                    renderer.render(error=target, time=SECONDS)
                    true = relative_rmse(renderer.image().astype(np.float64), truth)
                    ended = bool(renderer.error().high <= target)
                    row += 1, ended, *(ended and true > math.hypot(k * target, 2 * of_truth) for k in (1, 2))
                print(f"| {name} | {way} | {target:.0%} | {row[1]} of {row[0]} | {row[2]} | {row[3]} |", flush=True)
                count += row
    print(f"\n{count[1]} of {count[0]} ended; the true error was larger in {count[2]}, more than twice in {count[3]}.")


def pictures(names: list[str]) -> None:
    """Print what four pictures state of their errors, and write them, each above its reference, into a file."""
    columns = []
    for name, way, seed in SHOWN:
        scene = SCENES[name]()
        truth, _ = References(scene).of(way)
        renderer = way.renderer(scene, seed).render(SPP[0])
        picture, stated = renderer.image().astype(np.float64), renderer.error()
        print(f"{name}, {way}, {SPP[0]} samples: {stated}; true {relative_rmse(picture, truth):.1%}")
        columns.append(np.concatenate([picture, truth]) * BRIGHTNESS / np.median(truth))
    row = np.concatenate(columns, axis=1).repeat(LARGER, 0).repeat(LARGER, 1)
    bits = (255 * np.clip(row, 0, 1) ** (1 / 2.2)).astype(np.uint8)
    Image.fromarray(bits).quantize(COLOURS).save(*names, optimize=True)


def main() -> None:
    """Measure what is asked for, by default the cells."""
    measured = {"cells": cells, "stops": stops, "pictures": pictures}
    what, *names = sys.argv[1:] or ["cells"]
    print(describe_machine())
    measured[what](names or ([PICTURE] if what == "pictures" else list(SCENES)))


if __name__ == "__main__":
    tt.init(arch="auto")
    main()
