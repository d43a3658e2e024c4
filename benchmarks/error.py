"""Is the estimated error of a picture true? Is the predicted number of samples right? What do the estimates cost?

python -m benchmarks.error [calibration | prediction | bookkeeping ...]
"""

import math
import sys

import numpy as np
import taichi as ti

import taichi_tracer as tt
from benchmarks.measure import describe_machine, interleaved, ratio_table
from taichi_tracer.picture.film import Film, add_to_pair
from taichi_tracer.scene_data_loader import scene_names
from taichi_tracer.studies.metrics import relative_rmse

RENDERS, SIZE, SPP = 200, 64, 16
REFERENCE_SPP, REFERENCE_SEED = 8192, 10**6  # of the picture that errors are measured against
PREDICTION_SIZE, MOST_SPP = 192, 20_000
TARGETS = {"cornell_box": 0.08, "specular_spheres": 0.03, "sphere": 0.02, "torus_knot": 0.05, "cube": 0.02}


def calibration() -> str:
    """A table: how often the interval contains the true error, over many short renders of each shipped mesh."""
    lines = [f"\n**the 95 % interval, over {RENDERS} renders of {SIZE}², {SPP} samples, MIS, studio**\n"]
    lines += ["| scene | sampler | true error inside | told / true | reference's error |", "|---|---|--:|--:|--:|"]
    for name in [n for n in scene_names() if "/" not in n]:
        scene = tt.load_scene_data(name, environment="studio")
        truth = tt.A2Renderer(scene, SIZE, SIZE, seed=REFERENCE_SEED).use("mis").render(REFERENCE_SPP)
        image = truth.image().astype(np.float64)
        for sampler in ("sobol", "independent"):
            renderer = tt.A2Renderer(scene, SIZE, SIZE, sampler=sampler).use("mis")
            inside, ratios = 0, []
            for seed in range(RENDERS):
                renderer.seed = seed
                renderer.begin_anew()
                told = renderer.render(SPP).error()
                true = relative_rmse(renderer.image(), image)
                inside += told.low <= true <= told.high
                ratios.append(told / true)
            share, ratio = inside / RENDERS, math.exp(np.log(ratios).mean())
            lines.append(f"| {name} | {sampler} | {share:.1%} | {ratio:.3f} | {truth.error():.2%} |")
    return "\n".join(lines) + "\n"


def prediction() -> str:
    """A table: predicted / actual number of samples until an error, predicted after a tenth of the samples."""
    lines = ["\n**samples to an error as predicted at a tenth of them, over what it took, 192², MIS**\n"]
    lines += ["| scene | sampler | error | samples | predicted / actual |", "|---|---|--:|--:|--:|"]
    for name, target in TARGETS.items():
        scene = tt.load_scene_data(name, environment="studio")
        for sampler, factor in (("sobol", 1), ("independent", 3)):
            renderer = tt.A2Renderer(scene, PREDICTION_SIZE, PREDICTION_SIZE, sampler=sampler).use("mis")
            seen = []
            renderer.render(
                error=target * factor, spp=MOST_SPP, watch=lambda p, s=seen: s.append((p.samples, p.samples_left))
            )
            end = seen[-1][0]
            n, left = next((n, left) for n, left in seen if n >= end / 10)
            lines.append(f"| {name} | {sampler} | {target * factor:.1%} | {end} | {(n + left) / end:.2f} |")
    return "\n".join(lines) + "\n"


@ti.data_oriented
class PlainFilm(Film):
    """A film that only adds up the samples in one compensated sum, without anything for the error."""

    @ti.func
    def add(self, x, y, value, sample):
        """Add one sample to a pixel."""
        total, rest = add_to_pair(self.total[x, y, 0], self.rest[x, y, 0], value, ti.math.vec3(0))
        self.total[x, y, 0], self.rest[x, y, 0] = total, rest
        n = self.count[x, y] + 1
        self.count[x, y] = n
        self.canvas[x, y] = total / n


def bookkeeping() -> str:
    """Tables: the time of a sample, with and without the sums for the error."""
    report = ""
    for name, size in (("specular_spheres", 512), ("cornell_box", 256)):
        scene = tt.load_scene_data(name, environment="studio")
        renderers = {"error known": tt.A2Renderer(scene, size, size), "only sums": tt.A2Renderer(scene, size, size)}
        renderers["only sums"].film = PlainFilm(size, size, None, True)

        def render(renderer):
            renderer.use("mis").render(8)
            ti.sync()

        seconds = interleaved({n: lambda r=r: render(r) for n, r in renderers.items()}, 15)
        milliseconds = {n: s / 8 for n, s in seconds.items()}
        report += ratio_table(f"bookkeeping, {name}, {size}², MIS", milliseconds, "only sums", "ms per sample")
    return report


PARTS = {"calibration": calibration, "prediction": prediction, "bookkeeping": bookkeeping}


if __name__ == "__main__":
    tt.init(arch="auto")
    print(describe_machine() + "".join(PARTS[name]() for name in sys.argv[1:] or PARTS))
