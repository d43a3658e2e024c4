"""The hierarchy that is there to be read: a tree, a stack that is deep enough, and the answers of brute force.

In plain form it is compared, bit for bit, with the plain form of brute force and with the wide tree that stands in for
it.
"""

import numpy as np
import pytest
from compare import assert_same_answers
from shapes import BOXES, lattice, random_spheres, soup, sphere, with_spheres

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.intersectors import bvh
from taichi_tracer.intersectors.bvh import BVHRayIntersector
from taichi_tracer.intersectors.wide_bvh import WideBVH
from taichi_tracer.ray_intersector import BruteForceRayIntersector


def concentric(rng):
    """Boxes about one centre, each twice as large as the one before: nothing separates them but their size."""
    half = 2.0 ** np.arange(-60, 60)[:, None] * [1, 1, 1]
    return np.concatenate([-half, half], axis=1)


ALL_BOXES = {**BOXES, "concentric": concentric}


def boxes_of(name, rng):
    return np.ascontiguousarray(ALL_BOXES[name](rng), np.float32)


def test_no_boxes_are_one_empty_leaf():
    nodes, order, depth = bvh.build(np.zeros((0, 6), np.float32))
    ((box, first, count),) = nodes
    assert (first, count, len(order), depth) == (0, 0, 0, 1)
    assert not (box[:3] <= box[3:]).any()  # inside out: no ray is in it


def test_equal_items_are_cut_in_halves():
    _, _, depth = bvh.build(np.tile(np.array([[0, 0, 0, 1, 1, 1]], np.float32), (1_000, 1)))
    assert depth == 1 + np.ceil(np.log2(1_000 / bvh.MOST_IN_A_LEAF))


def test_the_heuristic_separates_two_clusters(rng):
    """Two far clusters: the root's children are they, whatever their sizes."""
    near, far = (BOXES["few"](rng)[:k] for k in (3, 9))
    nodes, order, _ = bvh.build(np.concatenate([near, far + 50]).astype(np.float32))
    _, first, _ = nodes[0]
    highs = sorted(nodes[child][0][3] for child in (first, first + 1))
    assert highs[0] < 2 < 49 < highs[1]


def test_the_cheapest_cut_is_the_cheapest(rng):
    """By all cuts along all axes, one by one."""
    boxes = BOXES["few"](rng)

    def half_area(part):
        x, y, z = part[:, 3:].max(axis=0) - part[:, :3].min(axis=0)
        return x * y + y * z + z * x

    costs = {len(boxes) * half_area(boxes): 0}
    for axis in range(3):
        by_axis = boxes[np.argsort(boxes[:, axis] + boxes[:, axis + 3], kind="stable")]
        for count in range(1, len(boxes)):
            left, right = by_axis[:count], by_axis[count:]
            cost = half_area(left) * count + half_area(right) * len(right) + bvh.COST_OF_BOX * half_area(boxes)
            costs[cost] = count
    count, order = bvh.cheapest_cut(boxes)
    assert count == costs[min(costs)]
    left, right = boxes[order[:count]], boxes[order[count:]]
    total = half_area(left) * count + half_area(right) * len(right) + bvh.COST_OF_BOX * half_area(boxes)
    assert total == pytest.approx(min(costs))


# ── the answers ──


def forms(mesh, test="watertight"):
    """The scene by plain brute force, by the plain hierarchy, and by the wide tree."""
    options = {"triangle_test": test}
    scenes = (
        tt.SceneData(mesh, intersector="brute_force", **options),
        tt.SceneData(mesh, intersector="bvh", **options),
        tt.SceneData(mesh, **options),
    )
    kinds = [type(scene.ray_intersector) for scene in scenes]
    assert kinds == [BruteForceRayIntersector, BVHRayIntersector, WideBVH]
    return scenes


def check(mesh, origins, directions, test="watertight"):
    """All three answer alike, within an interval as well; returns the hits."""
    truth, plain, wide = forms(mesh, test)
    hits = assert_same_answers(truth, plain, origins, directions)
    assert_same_answers(plain, wide, origins, directions)
    some = slice(None, None, 4)
    interval = {"t_min": 0.25, "t_max": np.where(hits.is_hit, hits.distance, 2.0)[some]}
    assert_same_answers(truth, plain, origins[some], directions[some], **interval)
    for scene in (truth, plain, wide):
        scene.destroy()
    return hits


def culled(rng):
    return Mesh(*soup(rng, 120), face_culls=np.arange(120) % 3 != 0)


def among_spheres(rng):
    vertices, faces = soup(rng, 60)
    return with_spheres(random_spheres(rng, 40, 0.6), vertices * 3, faces)


def culled_among_spheres(rng):
    mesh = among_spheres(rng)
    mesh.face_culls = np.arange(60) % 2 == 0
    return mesh


MESHES = {
    "soup": lambda rng: Mesh(*soup(rng, 150)),
    "lattice": lambda rng: Mesh(*lattice(rng, 60)),
    "closed": lambda rng: Mesh(*sphere(12, 7, 2.0)),
    "culled": culled,
    "spheres among triangles": among_spheres,
    "culled triangles among spheres": culled_among_spheres,
    "spheres alone": lambda rng: with_spheres(random_spheres(rng, 30)),
    "one triangle": lambda rng: Mesh(np.eye(3), np.array([[0, 1, 2]])),
}


QUICK = ("closed", "lattice", "culled triangles among spheres")


# ── the intersector ──


def test_facts_are_those_of_the_tree(f32):
    tree = tt.scene_from_mesh(*sphere(12, 7), intersector="bvh").ray_intersector
    assert tree.facts() == {"nodes": f"{tree.num_nodes:,}", "stack": f"{tree.stack_size}"}
    assert tree.num_nodes > 20
    assert tree.stack_size == 64  # the tree is not deep
