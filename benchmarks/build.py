"""The build of the hierarchy, compared with Embree and Mitsuba 3: time, and bytes per triangle.

python -m benchmarks.build [TRIANGLES ...]
"""

import sys

import taichi_tracer as tt
from benchmarks.helper import describe_machine, interleaved, meshes_of, ratio_table
from benchmarks.peers import MitsubaScene, embree_scene
from taichi_tracer.intersectors.wide_bvh import WideBVH

SIZES = 82_000, 1_300_000


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
    text = ratio_table(f"{name}: build", interleaved(candidates), "embreex", "ms")
    tree = trees[0]
    return text + f"\nmemory: {tree.bytes / tree.num_leaf_triangles:.0f} bytes per triangle, depth {tree.depth}\n"


if __name__ == "__main__":
    print(describe_machine())
    tt.init(arch="auto")
    for mesh_name, mesh in meshes_of(sys.argv[1:], SIZES).items():
        print(measure(mesh_name, *mesh))
