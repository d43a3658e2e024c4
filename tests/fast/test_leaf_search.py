"""Four triangles that are solved at once have the bits of the plain test, also where a ray passes exactly an edge."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import random_rays
from support import start

import taichi_tracer as tt
from taichi_tracer.contracts.shapes import lattice, soup
from taichi_tracer.fast.bvh_build import BLOCK
from taichi_tracer.fast.leaf_blocks import aim_of, is_inside, may_be_inside
from taichi_tracer.ray import Ray
from taichi_tracer.system import runtime


def rays_through(vertices, faces, rng, count=400):
    """Random rays, half of which pass exactly through a vertex, from points of a lattice."""
    origins, directions = random_rays(rng, count)
    corner = vertices[faces[rng.integers(0, len(faces), count // 2), 0]]
    origins[: count // 2] = np.round(origins[: count // 2])
    directions[: count // 2] = corner - origins[: count // 2]
    return origins, directions


def scene_of(shape, rng, precision, **options):
    start(precision)
    vertices, faces = shape(rng, 60)
    return tt.scene_from_mesh(vertices.astype(np.float32), faces, **options), vertices, faces


@pytest.mark.parametrize("precision", ["f32"])
@pytest.mark.parametrize("shape", [soup, lattice])
@pytest.mark.filterwarnings("ignore:mesh")
def test_each_triangle_of_a_block_has_the_answer_of_the_plain_test(shape, precision, rng):
    scene, vertices, faces = scene_of(shape, rng, precision)
    tree = scene.ray_intersector
    assert tree.solves_blocks
    origins, directions = rays_through(vertices, faces, rng)
    counts = np.zeros(4, np.int32)  # hits, edges of 0 among them, other answers, misses

    @ti.kernel
    def count(o: ti.types.ndarray(ndim=2), d: ti.types.ndarray(ndim=2), counts: ti.types.ndarray(ndim=1)):
        for i, block in ti.ndrange(o.shape[0], tree.num_places // BLOCK):
            ray = Ray(origin=tm.vec3(o[i, 0], o[i, 1], o[i, 2]), direction=tm.vec3(d[i, 0], d[i, 1], d[i, 2]))
            bounds, aim = tree.ray_bounds(ray), aim_of(ray)
            u_edge, v_edge, w_edge = tree.blocks.edges(aim, block)
            may_hit, distances = may_be_inside(u_edge, v_edge, w_edge), tree.blocks.distances(ray, bounds, aim, block)
            for lane in range(BLOCK):
                v0, v1, v2 = tree.blocks.triangle(BLOCK * block + lane)
                if not tm.isnan(v0.x):
                    wanted, wanted_u, wanted_v = tree.try_corners(ray, bounds, 0, v0, v1, v2)
                    found, u, v, w = -tm.inf, u_edge[lane], v_edge[lane], w_edge[lane]
                    is_zero = u == 0 or v == 0 or w == 0
                    if is_zero:
                        u, v, w = tree.blocks.exact_edges(aim, BLOCK * block + lane)
                    if may_hit[lane] and is_inside(u, v, w):
                        found = distances[lane]
                    total = u + v + w
                    same = found == wanted and (found == -tm.inf or (v / total == wanted_u and w / total == wanted_v))
                    if not same:
                        counts[2] += 1
                    elif found > -tm.inf:
                        counts[0] += 1
                        counts[1] += ti.cast(is_zero, ti.i32)
                    else:
                        counts[3] += 1

    count(origins.astype(runtime.dtype()), directions.astype(runtime.dtype()), counts)
    assert counts[2] == 0
    assert counts[0] > 100
    assert counts[1] > 0
    assert counts[3] > 1000


@pytest.mark.parametrize("options", [{"triangle_test": "moller_trumbore"}, {"intersector": "brute_force"}])
def test_other_tests_try_one_triangle_after_the_other(options, rng):
    scene, _, _ = scene_of(soup, rng, "f32", **options)
    assert not getattr(scene.ray_intersector, "solves_blocks", False)
