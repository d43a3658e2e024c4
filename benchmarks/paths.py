"""Paths, compared with Mitsuba 3: time per sample, and time to an error.

python -m benchmarks.paths
"""

from collections.abc import Callable

import taichi_tracer as tt
from benchmarks.helper import BLOB_VIEW, describe_machine, error_table, sample_table, scan_on_floor, sun_and_sky
from benchmarks.mitsuba_scenes import MitsubaPicture, path
from taichi_tracer.progressive import ProgressiveRenderer

SCENE = "cornell_box"
SIZE, BOUNCES = 128, 5  # of the time per sample
ERROR_SIZE = 64  # Mitsuba renders 1024 samples at once: at 256² that is a minute for each sampler and picture
SAMPLERS = ("multijitter", "ldsampler")  # of Mitsuba, the best on these scenes
# Title → (a shipped scene or a mesh, bounces, options of a scene that is a mesh).
PICTURES: dict[str, Callable[[], tuple]] = {
    "cornell_box, its lamp alone": lambda: (SCENE, 1, {}),
    "cornell_box, 6 segments": lambda: (SCENE, 6, {}),
    "a scan on a floor under a sky, 3 bounces": lambda: (
        scan_on_floor(),
        3,
        {"view": BLOB_VIEW, "environment": sun_and_sky()},
    ),
}


def renderer_of(scene: tt.SceneData, size: int, estimator: str, bounces: int, seed: int = 0) -> tt.A4Renderer:
    """A renderer of paths."""
    renderer = tt.A4Renderer(scene, size, size, seed=seed).use(estimator)
    renderer.max_bounces = bounces
    return renderer


def per_sample() -> str:
    """A table: milliseconds for one sample of every pixel."""
    scene = tt.load_scene_data(SCENE)
    ours = {name: renderer_of(scene, SIZE, name, BOUNCES) for name in ("path", "explicit", "implicit")}
    title = f"{SCENE}, {SIZE}², {BOUNCES} bounces"
    return sample_table(title, ours, MitsubaPicture(SCENE, path(BOUNCES), SIZE, SIZE))


def to_error(title: str, what, bounces: int, options: dict) -> str:
    """A table: seconds to 5, 2 and 1 %, of ours as a user gets it, and of Mitsuba with its samplers."""
    scene = tt.load_scene_data(what) if isinstance(what, str) else tt.SceneData(what, **options)
    integrator, size = path(bounces), (ERROR_SIZE, ERROR_SIZE)
    theirs = {name: MitsubaPicture(what, integrator, *size, sampler=name, **options) for name in SAMPLERS}

    def make(estimator: str, seed: int) -> ProgressiveRenderer:
        return renderer_of(scene, ERROR_SIZE, estimator, bounces, seed)

    return error_table(f"{title}, {ERROR_SIZE}²", make, ("path", "explicit"), theirs)


if __name__ == "__main__":
    print(describe_machine())
    tt.init(arch="auto")
    print(per_sample())
    for picture_title, make_picture in PICTURES.items():
        print(to_error(picture_title, *make_picture()), flush=True)
