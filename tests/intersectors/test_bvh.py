"""The hierarchy that is there to be read: a tree, a stack that is deep enough, and the answers of brute force.

In plain form it is compared, bit for bit, with the plain form of brute force and with the wide tree that stands in for
it.
"""

import numpy as np
import pytest
from compare import assert_same_answers
from shapes import BOXES, SQUARE, lattice, random_rays, random_spheres, soup, sphere, with_spheres
from support import long_except

import taichi_tracer as tt
from taichi_tracer.fast.wide_bvh import WideBVH
from taichi_tracer.geometry import Mesh
from taichi_tracer.intersectors import bvh
from taichi_tracer.intersectors.bvh import BVHRayIntersector
from taichi_tracer.ray_intersector import BruteForceRayIntersector


def concentric(rng):
    """Boxes about one centre, each twice as large as the one before: nothing separates them but their size."""
    half = 2.0 ** np.arange(-60, 60)[:, None] * [1, 1, 1]
    return np.concatenate([-half, half], axis=1)


ALL_BOXES = {**BOXES, "concentric": concentric}


def boxes_of(name, rng):
    return np.ascontiguousarray(ALL_BOXES[name](rng), np.float32)


# ── the tree ──


@pytest.mark.long
@pytest.mark.parametrize("name", [n for n in ALL_BOXES if n != "many, in groups"])
def test_the_tree_is_one(name, rng):
    """Every item is in one leaf, every box is that of what is below it, and leaves are small."""
    boxes = boxes_of(name, rng)
    nodes, order, depth = bvh.build(boxes)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(boxes)))
    seen, deepest, visited = np.zeros(len(boxes), int), 0, 0
    waiting = [(0, 1)]
    while waiting:
        node, level = waiting.pop()
        box, first, count = nodes[node]
        deepest, visited = max(deepest, level), visited + 1
        if count > 0:
            assert count <= bvh.MOST_IN_A_LEAF
            items = boxes[order[first : first + count]]
            seen[order[first : first + count]] += 1
        else:
            items = np.array([nodes[first][0], nodes[first + 1][0]])
            waiting += [(first, level + 1), (first + 1, level + 1)]
        np.testing.assert_array_equal(box[:3], items[:, :3].min(axis=0))
        np.testing.assert_array_equal(box[3:], items[:, 3:].max(axis=0))
    assert (seen == 1).all()
    assert visited == len(nodes)
    assert deepest == depth


@pytest.mark.long
@pytest.mark.parametrize("name", [n for n in ALL_BOXES if n != "many, in groups"])
def test_the_stack_never_overflows(name, rng):
    """Where a ray meets every box: the highest place of the stack that ``search`` writes to."""
    nodes, _, depth = bvh.build(boxes_of(name, rng))
    stack, highest = [0], 0
    while stack:
        _, first, count = nodes[stack.pop()]
        if count == 0:
            stack += [first + 1, first]
            highest = max(highest, len(stack) - 1)
    stack_size = depth + 1  # as ``BVHRayIntersector.bind`` has it
    assert highest < stack_size
    assert depth < 200


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
        tt.SceneData(mesh, intersector="brute_force", fast=False, **options),
        tt.SceneData(mesh, intersector="bvh", fast=False, **options),
        tt.SceneData(mesh, intersector="bvh", **options),
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


@pytest.mark.long
@pytest.mark.parametrize("name", long_except(MESHES, *QUICK))
def test_it_answers_as_brute_force_and_as_the_wide_tree(precision, name, rng):
    mesh = MESHES[name](rng)
    if len(mesh.faces) > 0:
        mesh.vertices = mesh.vertices.astype(np.float32).astype(float)
    origins, directions = random_rays(rng, 4_000, reach=3)
    aimed = mesh.vertices[mesh.faces[rng.integers(0, len(mesh.faces), 1_000), 0]] if len(mesh.faces) > 0 else 0
    directions[2_000:3_000] = aimed - origins[2_000:3_000]
    hits = check(mesh, origins, directions)
    assert 0.01 < hits.is_hit.mean() < 0.99


@pytest.mark.long
def test_it_answers_as_brute_force_with_the_other_triangle_test(precision, rng):
    hits = check(Mesh(*soup(rng, 100)), *random_rays(rng, 3_000, reach=2), test="moller_trumbore")
    assert hits.is_hit.any()


@pytest.mark.long
def test_of_a_thousand_equal_triangles_the_first_is_met(precision, rng):
    mesh = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.tile(np.array([[0, 1, 2]], np.int32), (1_000, 1)))
    origins = np.column_stack([rng.uniform(-0.2, 1, (500, 2)), np.ones(500)])
    hits = check(mesh, origins, np.tile([0.0, 0, -1], (500, 1)))
    assert set(hits.triangle_id[hits.is_hit]) == {0}
    assert hits.is_hit.any()


@pytest.mark.long
@pytest.mark.parametrize(
    "mesh",
    [
        pytest.param(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)), marks=pytest.mark.long),
        Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], np.int32)),
        Mesh(np.array([[np.nan, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.int32)),
    ],
    ids=["no triangles", "no area", "not finite"],
)
def test_where_nothing_can_be_met_nothing_is(precision, mesh, rng):
    hits = check(mesh, *random_rays(rng, 50))
    assert not hits.is_hit.any()


@pytest.mark.long
def test_rays_that_are_none_miss(f32):
    origins = np.array([[0, 0, 1], [0, 0, 1], [np.nan, 0, 1], [0, np.inf, 1]], np.float32)
    directions = np.array([[0, 0, 0], [0, 0, np.nan], [0, 0, -1], [0, 0, -1]], np.float32)
    assert not check(Mesh(*SQUARE), origins, directions).is_hit.any()


# ── the intersector ──


def test_facts_are_those_of_the_tree(f32):
    tree = tt.scene_from_mesh(*sphere(12, 7), intersector="bvh", fast=False).ray_intersector
    assert tree.facts() == {"nodes": f"{tree.num_nodes:,}", "stack": f"{tree.stack_size}"}
    assert tree.num_nodes > 20
    assert tree.stack_size == 64  # the tree is not deep


@pytest.mark.long
def test_pictures_by_the_plain_hierarchy_are_those_of_the_wide_tree(f32):
    images = [
        tt.A1Renderer(tt.scene_from_mesh(*sphere(), fast=fast), 24, 24).use("normal").image() for fast in (True, False)
    ]
    np.testing.assert_array_equal(*images)


@pytest.mark.long
def test_a_destroyed_tree_leaves_others_alone(f32):
    first, second = (tt.scene_from_mesh(*SQUARE, fast=False) for _ in range(2))
    first.destroy()
    assert second.intersect([0, 0.1, 1], [0, 0, -1]).is_hit[0]
