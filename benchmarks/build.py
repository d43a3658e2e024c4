"""The build of the hierarchy, compared with Embree and Mitsuba 3: time, and bytes per triangle.

python -m benchmarks.build [TRIANGLES | FILE ...]
"""

import sys

import taichi_tracer as tt
from benchmarks.measure import describe_machine, interleaved, ratio_table
from benchmarks.meshes import from_arguments
from benchmarks.peers import MitsubaScene, embree_scene
from taichi_tracer.intersectors.wide_bvh import WideBVH

RUNS = 5  # builds of each candidate


def measure(name: str, vertices, faces) -> str:
    """A markdown table for one mesh."""
    scene = tt.scene_from_mesh(vertices, faces, intersector="brute_force")
    trees = []

    def ours() -> None:
        for tree in trees:
            tree.destroy()  # the memory of a field is not freed by itself
        trees[:] = [WideBVH(scene.geometry)]

    def embree() -> None:
        one = vertices[:1].astype("f4")
        embree_scene(vertices, faces).run(one, one)  # Embree builds its tree when it is first used

    candidates = {"embreex": embree, "Mitsuba llvm": lambda: MitsubaScene(vertices, faces), "taichi_tracer": ours}
    table = ratio_table(f"{name}: build", interleaved(candidates, RUNS), "embreex", "ms")
    tree = trees[0]
    return table + f"\nmemory: {tree.bytes / tree.num_leaf_triangles:.0f} bytes per triangle, depth {tree.depth}\n"


def report(arguments: list[str]) -> str:
    """The tables for every requested mesh."""
    tt.init(arch="auto")
    return "".join(measure(name, *mesh) for name, mesh in from_arguments(arguments).items())


if __name__ == "__main__":
    print(describe_machine() + report(sys.argv[1:]))
