"""Objects in several places beside copies of them: rays each second, the time to build, and memory.

python -m benchmarks.instances [triangles] [places]
"""

import sys
import time

import numpy as np

import taichi_tracer as tt
from benchmarks.measure import describe_machine, interleaved, ratio_table
from benchmarks.meshes import displaced_sphere

RAYS = 1 << 20
MANY = 1_000  # places of which no copies are made


def forest(triangles: int, places: int) -> tt.Mesh:
    """A displaced sphere in a square of places, turned and scaled in each."""
    rng = np.random.default_rng(1)
    ball = tt.Mesh(*displaced_sphere(triangles))
    transforms = np.tile(np.eye(4), (places, 1, 1))
    turns, _ = np.linalg.qr(rng.normal(size=(places, 3, 3)))
    transforms[:, :3, :3] = turns * rng.uniform(0.5, 1, (places, 1, 1))
    side = int(np.ceil(places**0.5))
    transforms[:, 0, 3], transforms[:, 2, 3] = 2.2 * (np.arange(places) % side), 2.2 * (np.arange(places) // side)
    return tt.group([tt.Instances(ball, transforms)])


def resident() -> float:
    """The memory of this process in MB."""
    with open("/proc/self/status", encoding="ascii") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


def main(triangles: int = 80_000, places: int = 16) -> None:
    """Print the tables."""
    print(describe_machine())
    warm = tt.scene_from_mesh(forest(triangles, 1), instances="shared")
    warm.intersect([0, 0, 9], [0, 0, -1])
    before, start = resident(), time.perf_counter()
    many = tt.scene_from_mesh(forest(triangles, MANY), instances="shared")
    many.intersect([0, 0, 9], [0, 0, -1])
    print(
        f"{MANY:,} places of {triangles:,} triangles: {time.perf_counter() - start:.2f} s, "
        f"{resident() - before:.0f} MB more than one place"
    )
    mesh, rng = forest(triangles, places), np.random.default_rng(2)
    scenes = {name: tt.scene_from_mesh(mesh, instances=name) for name in ("copied", "shared")}
    geometry = scenes["copied"].geometry
    origins = rng.uniform(geometry.low, geometry.high, (RAYS, 3)).astype(np.float32)
    directions = rng.normal(size=(RAYS, 3)).astype(np.float32)
    for what in ("intersect", "occluded"):
        calls = {
            name: lambda scene=scene, what=what: getattr(scene, what)(origins, directions)
            for name, scene in scenes.items()
        }
        medians = {name: 1e6 * seconds / RAYS for name, seconds in interleaved(calls).items()}
        title = f"{places} places of {triangles:,} triangles, {what} of {RAYS:,} incoherent rays"
        print(ratio_table(title, medians, "copied", "ns per ray"))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
