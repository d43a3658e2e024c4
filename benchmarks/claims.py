"""Do claims of errors hold where light is hard to find? On scenes that had no part in choosing anything.

python -m benchmarks.claims cells [SCENE ...]
    Every estimator of A3 and A4, at 1, 3 and 8 bounces, 16 and 64 samples; and pictures that are adaptive, cropped,
    merged of two halves, or continued from a file. A cell fails if fewer than 90 % of its renders hold the truth, or if
    more than 1 % are wrong by more than twice: a render that says "unknown" is not wrong.
python -m benchmarks.claims stops [SCENE ...]
    Renderings to an error of 5 and 2 %: does one end although its true error is larger?
python -m benchmarks.claims references [SCENE ...]
    Is the reference the same picture as Mitsuba's? By blocks of pixels.
python -m benchmarks.claims pictures [FILE.png]
    Four claims that samples alone would get wrong, each with its picture above the true one.
"""

import math
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

import taichi_tracer as tt
from benchmarks.claim_scenes import SCENES
from benchmarks.error import Cell
from benchmarks.measure import describe_machine
from taichi_tracer.files.checkpoint import EXTENSION
from taichi_tracer.picture.bias import blocks_of, shift_of
from taichi_tracer.picture.metrics import relative_rmse

SIZE, SPP, RENDERS = 48, (16, 64), 100
CROP = (11, 40, 8, 43)  # pixels
REFERENCE_SPP, REFERENCE_SEED = 8192, 10**6
LEAST_INSIDE, MOST_WRONG = 0.9, 0.01
TARGETS, STOPS, SECONDS = (0.05, 0.02), 4, 2.0
PICTURES, PICTURE_SPP = 8, 1024  # of the project and of Mitsuba, whose spread tells their errors
FINER = 8  # texels of the sky for Mitsuba, which interpolates between them


@dataclass(frozen=True)
class Way:
    """How pictures are made.

    Attributes:
        estimator: its name. bounces: of paths; 0 for direct light.
        how: "adaptive", "crop", "merged" or "continued"; an empty text for nothing of these.
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
OTHERS = tuple(Way(*of, how) for of in (("mis", 0), ("path", 3)) for how in ("adaptive", "crop", "merged", "continued"))
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


def grown(way: Way, scene: tt.SceneData) -> Callable:
    """What makes the pictures of a seed with each of ``SPP`` samples, one after the other, and yields renderers."""
    renderer = way.renderer(scene)

    def one_after_the_other(seed: int):
        renderer.seed = seed
        renderer.begin_anew()
        done = 0
        for samples in SPP:
            yield renderer.render(samples - done)
            done = samples

    return one_after_the_other


def merged(way: Way, scene: tt.SceneData) -> Callable:
    """The same, where two renderers take one half of the samples each."""
    first = way.renderer(scene)
    seconds = {samples: way.renderer(scene, first_sample=samples // 2) for samples in SPP}

    def both(seed: int):
        for samples in SPP:
            for renderer in (first, seconds[samples]):
                renderer.seed = seed
                renderer.begin_anew()
                renderer.render(samples // 2)
            first.film.merge(seconds[samples].film)
            yield first

    return both


def continued(way: Way, scene: tt.SceneData) -> Callable:
    """The same, where one renderer writes half of the samples into a file, and another one goes on from there."""
    first, second = way.renderer(scene), way.renderer(scene)
    file = Path(tempfile.mkdtemp()) / f"half{EXTENSION}"

    def from_a_file(seed: int):
        for samples in SPP:
            first.seed = second.seed = seed
            first.begin_anew()
            first.render(samples // 2)
            first.save_checkpoint(file)
            second.load_checkpoint(file)
            yield second.render(samples - samples // 2)

    return from_a_file


MADE = {"merged": merged, "continued": continued}


def own_pixels(renderer, picture: np.ndarray) -> np.ndarray:
    """The pixels that a renderer renders."""
    return renderer.film.own_pixels(picture).astype(np.float64)


def cells_of(way: Way, scene: tt.SceneData, references: References) -> list[tuple[int, Cell, int]]:
    """(samples, cell, renders that said "unknown") of a way."""
    truth, error = references.of(way)
    rows: list[list[tuple]] = [[] for _ in SPP]
    pictures = MADE.get(way.how, grown)(way, scene)
    for seed in range(RENDERS):
        for row, renderer in zip(rows, pictures(seed), strict=True):
            told = renderer.error()
            true = relative_rmse(own_pixels(renderer, renderer.image()), own_pixels(renderer, truth))
            row.append((float(told), told.low, told.high, true))
    arrays = [np.array(row) for row in rows]
    return [(n, Cell(*one.T, error), int(np.isnan(one[:, 0]).sum())) for n, one in zip(SPP, arrays, strict=True)]


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
            ones = [one for _, one, _ in found]
            fails = sum(bool(o.is_inside.mean() < LEAST_INSIDE or o.told_wrong(2) > MOST_WRONG) for o in ones)
            failed += fails
            widths += [one.width for one in ones]
            numbers = [f"{one.is_inside.mean():.0%}" for one in ones], [f"{one.told_wrong(2):.0%}" for one in ones]
            numbers += [f"{unknown}" for *_, unknown in found], [f"{one.width:.2f}" for one in ones]
            numbers += ([f"{np.median(one.true):.1%}" for one in ones],)
            told = " | ".join(", ".join(pair) for pair in numbers)
            print(f"| {name} | {way} | {told} | {ones[0].reference:.1%} | {fails or ''} |", flush=True)
        scene.destroy()
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
        scene.destroy()
    print(f"\n{count[1]} of {count[0]} ended; the true error was larger in {count[2]}, more than twice in {count[3]}.")


def pictures_of(render: Callable[[int], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The mean of pictures with several seeds, and its variance in every pixel."""
    made = np.array([render(seed) for seed in range(PICTURES)], np.float64)
    return made.mean(axis=0), made.var(axis=0, ddof=1) / PICTURES


def references(names: list[str]) -> None:
    """Print how the project's picture differs from Mitsuba's."""
    from benchmarks.mitsuba_scenes import MitsubaPicture, path

    print(f"\n{SIZE}², {PICTURES} pictures of {PICTURE_SPP:,} samples of each\n")
    print("| scene | light | difference of the means | its standard error | z, by blocks | largest block |")
    print("|---|---|--:|--:|--:|--:|")
    for name in names:
        scene = SCENES[name]()
        for way in (Way("mis"), Way("path", 3)):
            renderer = way.renderer(scene)

            def own(seed: int, renderer=renderer) -> np.ndarray:
                renderer.seed = seed
                renderer.begin_anew()
                return renderer.render(PICTURE_SPP).image()

            sky = None if scene.environment is None else scene.environment.pixels.repeat(FINER, 0).repeat(FINER, 1)
            other = MitsubaPicture(
                scene.mesh, path(max(1, way.bounces)), SIZE, SIZE, view=scene.view, environment=sky, is_exact=True
            )
            theirs = pictures_of(lambda seed, other=other: other.render(PICTURE_SPP, seed))
            ours, spread = pictures_of(own)
            shift, error, z = shift_of([(ours, spread)], theirs)
            d, v = (blocks_of(values.sum(axis=2)) for values in (ours - theirs[0], spread + theirs[1]))
            most = np.abs(d / np.sqrt(3 * v / 64 + 1e-30)).max()
            print(f"| {name} | {way} | {shift:+.2%} | {error:.2%} | {z:+.1f} | {most:.1f} |", flush=True)
        scene.destroy()


def pictures(names: list[str]) -> None:
    """Print what four pictures tell of their errors, and write them, each above its reference, into a file."""
    columns = []
    for name, way, seed in SHOWN:
        scene = SCENES[name]()
        truth, _ = References(scene).of(way)
        renderer = way.renderer(scene, seed).render(SPP[0])
        picture, told = renderer.image().astype(np.float64), renderer.error()
        print(f"{name}, {way}, {SPP[0]} samples: {told}; true {relative_rmse(picture, truth):.1%}")
        columns.append(np.concatenate([picture, truth]) * BRIGHTNESS / np.median(truth))
    row = np.concatenate(columns, axis=1).repeat(LARGER, 0).repeat(LARGER, 1)
    bits = (255 * np.clip(row, 0, 1) ** (1 / 2.2)).astype(np.uint8)
    Image.fromarray(bits).quantize(COLOURS).save(*names, optimize=True)


def main() -> None:
    """Measure what is asked for, by default the cells."""
    measured = {"cells": cells, "stops": stops, "references": references, "pictures": pictures}
    what, *names = sys.argv[1:] or ["cells"]
    print(describe_machine())
    measured[what](names or ([PICTURE] if what == "pictures" else list(SCENES)))


if __name__ == "__main__":
    tt.init(arch="auto")
    main()
