"""Blocks of leaves: each leaf has its own, nothing is lost, and every triangle that the plain test accepts is found."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import random_rays, soup
from support import start

import taichi_tracer as tt
from taichi_tracer.intersectors.bvh_build import BLOCK
from taichi_tracer.intersectors.lanes import first_lane
from taichi_tracer.intersectors.leaf_blocks import aim_of
from taichi_tracer.ray import Ray


@pytest.mark.parametrize("test", ["watertight", "moller_trumbore"])
def test_the_candidates_include_every_triangle_that_is_hit(test, rng):
    start("f32")
    vertices, faces = soup(rng, 60)
    tree = tt.scene_from_mesh(vertices, faces, triangle_test=test, intersector="wide_bvh").ray_intersector
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
    tree = tt.scene_from_mesh(vertices, faces, intersector="wide_bvh").ray_intersector
    out = np.zeros((tree.num_places, 3, 3), np.float32)
    vertices_at(tree, np.arange(tree.num_places, dtype=np.int32), out)
    is_used = ~np.isnan(out).any(axis=(1, 2))
    assert is_used.sum() == 77
    assert np.isnan(out[~is_used]).all()
    ids = tree.blocks.ids.to_numpy().reshape(-1)[: tree.num_places][is_used]
    assert sorted(ids) == list(range(77))
    np.testing.assert_array_equal(out[is_used], vertices[faces[ids]].astype(np.float32))
