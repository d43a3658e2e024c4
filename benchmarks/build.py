"""Building the hierarchy beside Embree and Mitsuba 3: seconds, and bytes per triangle.

python -m benchmarks.build [TRIANGLES | FILE ...]
"""

import sys

import taichi_tracer as tt
from benchmarks.measure import describe_machine, interleaved, ratio_table
from benchmarks.meshes import from_arguments
from benchmarks.peers import MitsubaScene, embree_scene
from taichi_tracer.fast.wide_bvh import BVHRayIntersector


def measure(name: str, vertices, faces) -> str:
    """A markdown table for one mesh."""
    scene = tt.scene_from_mesh(vertices, faces, intersector="brute_force")
    trees = []

    def ours() -> None:
        trees[:] = [BVHRayIntersector(scene.geometry)]

    def embree() -> None:
        one = vertices[:1].astype("f4")
        embree_scene(vertices, faces).run(one, one)  # it builds on first use

    candidates = {"embreex": embree, "Mitsuba llvm": lambda: MitsubaScene(vertices, faces), "taichi_tracer": ours}
    table = ratio_table(f"{name}: build", interleaved(candidates, 5), "embreex", "ms")
    tree = trees[0]
    return table + f"\nmemory: {tree.bytes / tree.num_leaf_triangles:.0f} bytes per triangle, depth {tree.depth}\n"


def report(arguments: list[str]) -> str:
    """Tables for every mesh that was asked for."""
    tt.init(arch="auto")
    return "".join(measure(name, *mesh) for name, mesh in from_arguments(arguments).items())


if __name__ == "__main__":
    print(describe_machine() + report(sys.argv[1:]))
