"""Milliseconds per frame against triangles, with brute force and with the hierarchy. Draws docs/images/frame_time.svg.

python -m benchmarks.frames
"""

import statistics
import time
from pathlib import Path

import taichi as ti

import taichi_tracer as tt
from benchmarks.helper import BLOB_VIEW, describe_machine, displaced_sphere, table

CHART = Path(__file__).parents[1] / "docs" / "images" / "frame_time.svg"
FEW = (2, 12, 50, 200, 1_000, 4_000)
MANY = (*FEW, 20_000, 82_000, 512_000, 1_300_000)
RESOLUTION, RUNS = 256, 5
WARM_UP = 2  # frames before the measurement, which compile the kernels
SMALLEST_SPHERE = 50  # triangles


def frame_milliseconds(intersector: str, triangles: int) -> float:
    """The median time of a normal view after a move of the camera, in milliseconds."""
    vertices, faces = displaced_sphere(max(triangles, SMALLEST_SPHERE))  # a smaller mesh is a part of it
    scene = tt.scene_from_mesh(vertices, faces[:triangles], intersector=intersector, view=BLOB_VIEW)
    renderer = tt.A1Renderer(scene, RESOLUTION, RESOLUTION).use("normal")
    seconds = []
    for _ in range(RUNS + WARM_UP):
        renderer.camera.version += 1
        start = time.perf_counter()
        renderer.render()
        ti.sync()
        seconds.append(time.perf_counter() - start)
    return 1e3 * statistics.median(seconds[WARM_UP:])


def draw(curves: dict[str, dict[int, float]]) -> None:
    """Draw the chart with logarithmic axes."""
    import matplotlib

    matplotlib.use("svg")
    from matplotlib import pyplot

    matplotlib.rcParams.update({"svg.hashsalt": "frame_time", "svg.fonttype": "none"})
    figure, axes = pyplot.subplots(figsize=(6.4, 4), layout="constrained")
    for name, curve in curves.items():
        axes.loglog(list(curve), list(curve.values()), marker="o", label=name)
    axes.set(xlabel="triangles", ylabel=f"ms per frame, {RESOLUTION}²", title="Time per frame against triangles")
    axes.grid(True, which="major", alpha=0.3)
    axes.legend()
    CHART.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(CHART, metadata={"Date": None})


if __name__ == "__main__":
    print(describe_machine())
    tt.init(arch="auto")
    found = {
        "brute force": {n: frame_milliseconds("brute_force", n) for n in FEW},
        "hierarchy": {n: frame_milliseconds("wide_bvh", n) for n in MANY},
    }
    draw(found)
    cells = [[f"{n:,}", *(f"{of[n]:.3g}" if n in of else "" for of in found.values())] for n in MANY]
    print(table(f"ms per frame, {RESOLUTION}², normal view", ["triangles", *found], cells))
