"""Blocks of leaves: each leaf has its own, nothing is lost, and every triangle that the plain test accepts is found."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import random_rays, soup
from support import start

import taichi_tracer as tt
from taichi_tracer.fast.bvh_build import BLOCK
from taichi_tracer.fast.bvh_wide import ABSENT, LEAF_BITS, leaf_reference
from taichi_tracer.fast.lanes import first_lane
from taichi_tracer.fast.leaf_blocks import aim_of, in_blocks, primitives_at_once
from taichi_tracer.formulas.triangles import moller_trumbore, watertight
from taichi_tracer.ray import Ray


def test_every_leaf_begins_with_a_block_of_its_own(rng):
    sizes = rng.integers(1, 9, 50)
    begin = np.cumsum(sizes) - sizes
    leaves = leaf_reference(begin, begin + sizes)
    shuffled = rng.permutation(50)
    references = np.concatenate([[3, ABSENT], leaves[shuffled], [7, ABSENT]]).astype(np.int32)
    moved, places = in_blocks(references, sizes.sum())
    assert moved[[0, 1, -2, -1]].tolist() == [3, ABSENT, 7, ABSENT]
    codes = -1 - moved[2:-2]
    first, count = codes >> LEAF_BITS, codes & ((1 << LEAF_BITS) - 1)
    assert (count == sizes[shuffled]).all()
    assert (first % BLOCK == 0).all()
    for leaf, start_of in zip(shuffled, first, strict=True):
        own = places[begin[leaf] : begin[leaf] + sizes[leaf]]
        assert own.tolist() == list(range(start_of, start_of + sizes[leaf]))
    blocks = [set(places[b : b + n] // BLOCK) for b, n in zip(begin, sizes, strict=True)]
    assert sum(map(len, blocks)) == len(set().union(*blocks))


def test_no_leaves_have_no_places():
    moved, places = in_blocks(np.array([ABSENT, 0], np.int32), 0)
    assert moved.tolist() == [ABSENT, 0]
    assert len(places) == 0


def test_only_triangles_of_a_test_with_a_form_for_blocks_are_tested_at_once():
    assert (
        primitives_at_once(watertight, is_mixed=False) == primitives_at_once(moller_trumbore, is_mixed=False) == BLOCK
    )
    assert primitives_at_once(watertight, is_mixed=True) == 1
    assert primitives_at_once(lambda o, d, v0, v1, v2: None, is_mixed=False) == 1


@pytest.mark.parametrize("test", ["watertight", "moller_trumbore"])
def test_the_candidates_include_every_triangle_that_is_hit(test, rng):
    start("f32")
    vertices, faces = soup(rng, 60)
    tree = tt.scene_from_mesh(vertices, faces, triangle_test=test).ray_intersector
    origins, directions = random_rays(rng, 500)
    corner = vertices[faces[rng.integers(0, 60, 200), 0]]  # exactly through a vertex, as far as f32 can say it
    directions[:200] = corner - origins[:200]
    counts = np.zeros(3, np.int32)  # hit and found, hit and not found, found but not hit

    @ti.kernel
    def count(o: ti.types.ndarray(ndim=2), d: ti.types.ndarray(ndim=2), counts: ti.types.ndarray(ndim=1)):
        for i, place in ti.ndrange(o.shape[0], tree.num_places):
            v0, v1, v2 = tree.blocks.triangle(place)
            if not tm.isnan(v0.x):
                ray = Ray(origin=tm.vec3(o[i, 0], o[i, 1], o[i, 2]), direction=tm.vec3(d[i, 0], d[i, 1], d[i, 2]))
                is_inside, _t, _u, _v, det = tree.solve(ray.origin, ray.direction, v0, v1, v2)
                mask = tree.blocks.candidates(ray, aim_of(ray), place // BLOCK, BLOCK)
                is_found = 0
                while mask != 0:
                    is_found |= ti.cast(first_lane(mask) == place % BLOCK, ti.i32)
                    mask &= mask - 1
                if is_inside and det != 0:
                    counts[1 - is_found] += 1
                elif is_found:
                    counts[2] += 1

    count(origins.astype(np.float32), directions.astype(np.float32), counts)
    assert counts[0] > 100
    assert counts[1] == 0
    assert counts[2] < counts[0]


@ti.kernel
def vertices_at(tree: ti.template(), places: ti.types.ndarray(ndim=1), out: ti.types.ndarray(ndim=3)):
    for i in range(places.shape[0]):
        v0, v1, v2 = tree.blocks.triangle(places[i])
        for k in ti.static(range(3)):
            out[i, 0, k], out[i, 1, k], out[i, 2, k] = v0[k], v1[k], v2[k]


def test_every_triangle_is_at_one_place_and_the_other_places_are_empty(rng):
    start("f32")
    vertices, faces = soup(rng, 77)
    tree = tt.scene_from_mesh(vertices, faces).ray_intersector
    out = np.zeros((tree.num_places, 3, 3), np.float32)
    vertices_at(tree, np.arange(tree.num_places, dtype=np.int32), out)
    is_used = ~np.isnan(out).any(axis=(1, 2))
    assert is_used.sum() == 77
    assert np.isnan(out[~is_used]).all()
    ids = tree.blocks.ids.to_numpy().reshape(-1)[: tree.num_places][is_used]
    assert sorted(ids) == list(range(77))
    np.testing.assert_array_equal(out[is_used], vertices[faces[ids]].astype(np.float32))
