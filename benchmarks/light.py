"""Direct light, compared with Mitsuba 3: time per sample, and time to an error.

python -m benchmarks.light
"""

import taichi_tracer as tt
from benchmarks.helper import (
    BLOB,
    BLOB_VIEW,
    SPHERES_VIEW,
    describe_machine,
    displaced_sphere,
    error_table,
    sample_table,
    sun_and_sky,
    three_spheres,
)
from benchmarks.mitsuba_scenes import MIS, MitsubaPicture
from taichi_tracer.geometry import Mesh
from taichi_tracer.progressive import ProgressiveRenderer

SIZE, ERROR_SIZE = 512, 256
THEIR_ESTIMATORS = {"brdf": {"type": "direct", "emitter_samples": 0, "bsdf_samples": 1}, "mis": MIS}
SAMPLERS = ("multijitter", "ldsampler", "orthogonal")  # of Mitsuba, the best on this scene


def per_sample(title: str, mesh: Mesh, view: dict) -> str:
    """Tables for both estimators: milliseconds for one sample of every pixel, under sun and sky."""
    scene, options = tt.SceneData(mesh, view=view, environment=sun_and_sky()), {"environment": sun_and_sky()}
    text = ""
    for estimator, integrator in THEIR_ESTIMATORS.items():
        theirs = MitsubaPicture(mesh, integrator, SIZE, SIZE, view=view, **options)
        ours = {estimator: tt.A2Renderer(scene, SIZE, SIZE).use(estimator)}
        text += sample_table(f"{title}, {SIZE}², {estimator}", ours, theirs)
    return text


def to_error() -> str:
    """A table: seconds to 5, 2 and 1 %."""
    scene = tt.SceneData(three_spheres(), view=SPHERES_VIEW, environment=sun_and_sky())
    options = {"environment": sun_and_sky(), "view": SPHERES_VIEW}
    size = ERROR_SIZE, ERROR_SIZE
    theirs = {name: MitsubaPicture(three_spheres(), MIS, *size, sampler=name, **options) for name in SAMPLERS}
    name = "multijitter, mis_compensation"  # an option of Mitsuba's environments, off by default
    theirs[name] = MitsubaPicture(three_spheres(), MIS, *size, sampler="multijitter", compensates=True, **options)

    def make(estimator: str, seed: int) -> ProgressiveRenderer:
        return tt.A2Renderer(scene, *size, seed=seed).use(estimator)

    return error_table(f"three spheres under sun and sky, {ERROR_SIZE}², mis", make, ("mis",), theirs)


if __name__ == "__main__":
    print(describe_machine())
    tt.init(arch="auto")
    print(per_sample("three spheres on a floor", three_spheres(), SPHERES_VIEW))
    print(per_sample(f"displaced sphere of {BLOB:,} triangles", Mesh(*displaced_sphere(BLOB)), BLOB_VIEW))
    print(to_error())
