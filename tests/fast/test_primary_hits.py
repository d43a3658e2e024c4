"""Packets and single rays give the same bits, and both what the intersector says."""

import numpy as np
import pytest
from shapes import lattice, soup, sphere

import taichi_tracer as tt
from taichi_tracer.camera import Camera
from taichi_tracer.fast import primary_hits
from taichi_tracer.fast.nearest import FastBruteForce
from taichi_tracer.fast.packet_shapes import PACKET_TESTS
from taichi_tracer.fast.primary_hits import PrimaryHits

FIELDS = ("distance", "triangle_id", "u", "v")


pytestmark = pytest.mark.usefixtures("f32")


def fields_of(hits):
    """Every field of the hits, as pictures."""
    return {name: hits.to_image(name) for name in FIELDS}


def assert_same_bits(single, packets):
    """Trace in both forms and compare; returns the ids."""
    for hits in (single, packets):
        hits.trace()
    assert single.packets is None
    assert packets.packets is not None
    a, b = fields_of(single), fields_of(packets)
    for name in FIELDS:
        np.testing.assert_array_equal(a[name], b[name], err_msg=name)
    return a["triangle_id"]


def many_shapes(rng):
    """A soup at the origin, a lattice of integers at x = 20, a closed sphere at x = −20."""
    parts = [soup(rng, 300), lattice(rng, 60), sphere()]
    vertices = [v + [x, 0, 0] for (v, _), x in zip(parts, (0, 20, -20), strict=True)]
    starts = np.cumsum([0, *(len(v) for v in vertices[:-1])])
    return np.concatenate(vertices), np.concatenate([f + n for (_, f), n in zip(parts, starts, strict=True)])


VIEWS = {
    "soup": {"eye": (0, 0.5, 4), "at": (0, 0, 0)},
    "lattice seen along an axis": {"eye": (20.0, 0.0, 6.0), "at": (20.0, 0.0, 0.0)},
    "lattice from a lattice point": {"eye": (22.0, 1.0, 6.0), "at": (22.0, 1.0, 0.0)},
    "inside a sphere": {"eye": (-19.9, 0.2, 0.3), "at": (-19.9, 0.2, 1.3), "fov": 160.0},
}


TEST_NAMES = [solve.__name__ for solve in PACKET_TESTS]


@pytest.mark.parametrize("test", [n for n in TEST_NAMES if n != "moller_trumbore"])
def test_packets_equal_single_rays_bit_for_bit(test, rng):
    scene = tt.scene_from_mesh(*many_shapes(rng), triangle_test=test)
    camera = Camera(61, 47)
    single, packets = (PrimaryHits(scene, camera, use_packets=use) for use in (False, True))
    for name, view in VIEWS.items():
        camera.set_camera_parameters(**{"fov": 60.0, **view})
        assert (assert_same_bits(single, packets) >= 0).mean() > 0.1, name


def test_a_search_of_every_primitive_equals_that_of_the_tree_bit_for_bit(rng, monkeypatch):
    """Little work is done without a tree; many tests, and rays that are traced for every sample, are not."""
    scene = tt.scene_from_mesh(*many_shapes(rng))
    camera = Camera(61, 47)
    monkeypatch.setattr(primary_hits, "FEW_TESTS", 1 << 60)
    every = PrimaryHits(scene, camera, use_packets=False)
    assert isinstance(every.searcher(), FastBruteForce)
    assert PrimaryHits(scene, camera, jitter=True).searcher() is scene.ray_intersector
    tree = PrimaryHits(scene, camera, use_packets=False)
    tree.without_tree = None
    assert tree.searcher() is scene.ray_intersector
    for view in VIEWS.values():
        camera.set_camera_parameters(**{"fov": 60.0, **view})
        for hits in (every, tree):
            hits.bring_up_to_date(0, 0)
        for name in ("distance", "triangle_id", "u", "v"):
            np.testing.assert_array_equal(every.to_image(name), tree.to_image(name))
    monkeypatch.setattr(primary_hits, "FEW_TESTS", every.traces * every.pixels * scene.geometry.n_primitives - 1)
    assert every.searcher() is scene.ray_intersector


def test_the_hits_are_those_of_intersect():
    scene = tt.load_scene_data("cornell_box")
    camera = Camera(20, 12, **scene.view)
    hits = PrimaryHits(scene, camera, use_packets=False)
    hits.trace()
    from oracles.rays import eye_rays

    view = {name: scene.view[name] for name in ("eye", "at", "up", "fov")}
    asked = scene.intersect(scene.view["eye"], eye_rays(**view, width=20, height=12).reshape(-1, 3))
    found = hits.to_image("triangle_id")[::-1]  # the oracle begins at the bottom
    assert (found.reshape(-1) == asked.triangle_id).mean() > 0.99
