"""Packets and single rays give the same bits, and both what the intersector says."""

import math

import numpy as np
import pytest
import taichi as ti
from shapes import SQUARE, lattice, random_spheres, soup, sphere, with_spheres

import taichi_tracer as tt
from taichi_tracer.camera import Camera
from taichi_tracer.fast import kept_forms, primary_hits
from taichi_tracer.fast.kept_forms import KeptForms
from taichi_tracer.fast.nearest import FastBruteForce
from taichi_tracer.fast.packet_shapes import PACKET_TESTS
from taichi_tracer.fast.primary_hits import PrimaryHits, why_not_kept
from taichi_tracer.geometry import Mesh
from taichi_tracer.ray_intersector import BruteForceRayIntersector
from taichi_tracer.sampler import sampler_of
from taichi_tracer.samplers.sobol import SobolSampler

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


def special(kind, rng):
    """A mesh of culled triangles, of spheres among them, or of neither."""
    vertices, faces = soup(rng, 80)
    culls = np.arange(80) % 2 == 0
    if kind == "spheres":
        return with_spheres(random_spheres(rng, 40, 0.4), vertices, faces, face_culls=culls)
    return Mesh(vertices, faces, face_culls=culls if kind == "culled" else None)


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


@pytest.fixture
def nothing_kept(monkeypatch):
    """A machine and a process that have no packets."""
    monkeypatch.setattr(kept_forms, "cache_folder", lambda _: (None, "read-only"))
    monkeypatch.setattr(primary_hits, "KEPT", KeptForms())


def test_packets_are_for_much_work_where_neighbours_have_something_in_common(nothing_kept):
    scene = tt.scene_from_mesh(*sphere())
    large, small = PrimaryHits(scene, Camera(256, 256)), PrimaryHits(scene, Camera(16, 16))
    assert not large.is_much_work()  # the first picture would wait for the compiler
    large.traces, small.traces = 1, 1
    assert large.is_much_work()
    assert not small.is_much_work()
    small.traces = 1 << 14
    assert not small.is_much_work()  # at this size, packets gain little
    small.traces = 1 << 17
    assert small.is_much_work()
    large.passes = 4
    assert not large.is_much_work()  # four pictures take less time than the compiler
    large.passes = 1024
    assert large.is_much_work()
    large.passes, large.traces = 4, 8  # the fifth picture was asked for, after all
    assert large.is_much_work()
    large.passes, large.traces = 1024, 0
    assert not large.is_much_work()  # without jitter, the rays of all passes are the same
    jittered = PrimaryHits(scene, Camera(256, 256), jitter=True)
    assert not jittered.is_much_work()
    jittered.passes = 1024
    assert jittered.is_much_work()  # single rays need not be compiled first
    jittered.passes = math.inf
    assert jittered.is_much_work()
    crowded = PrimaryHits(scene, Camera(4, 4))
    crowded.traces = 1 << 18
    assert scene.geometry.n_primitives > 8 * 16
    assert not crowded.is_much_work()


def test_hits_of_new_rays_in_each_pass_are_kept_only_if_packets_may_find_them(nothing_kept, monkeypatch):
    scene, large = tt.scene_from_mesh(*sphere()), ((0, 256), (0, 256))
    camera, points = Camera(256, 256), sampler_of(SobolSampler(), Camera(256, 256))
    assert why_not_kept(scene, camera, points, large) == ""
    assert "too small" in why_not_kept(scene, camera, points, ((0, 255), (0, 256)))
    brute = tt.scene_from_mesh(*sphere(), intersector=BruteForceRayIntersector.name)
    assert "no packets" in why_not_kept(brute, camera, points, large)
    assert "too few" in why_not_kept(scene, camera, points, large, passes=64)
    assert why_not_kept(scene, camera, points, large, passes=1024) == ""
    monkeypatch.setattr(primary_hits, "CROWD", scene.num_triangles / 256**2 / 2)
    assert "triangles for each pixel" in why_not_kept(scene, camera, points, large)


def test_brute_force_and_replaced_cameras_go_ray_by_ray():
    """Whoever replaces the plain form alone gets the plain form, not the packets of the class below."""
    brute = tt.load_scene_data("cube", intersector=BruteForceRayIntersector.name)
    assert not PrimaryHits(brute, Camera(8, 8)).can_use_packets

    class MyCamera(Camera):
        @ti.func
        def generate_ray(self, pixel_x, pixel_y):
            return tt.Ray(self.eye, self.z)

    scene = tt.load_scene_data("cube")
    assert PrimaryHits(scene, Camera(8, 8)).can_use_packets
    assert not PrimaryHits(scene, MyCamera(8, 8)).can_use_packets

    @ti.data_oriented
    class MySampler(SobolSampler):
        @ti.func
        def get_2d(self, seed, pixel, index, dimension):
            return ti.math.vec2(0.5)

    mine = sampler_of(MySampler(), Camera(8, 8))
    assert not PrimaryHits(scene, Camera(8, 8), True, mine).can_use_packets


def test_hits_stay_until_the_camera_moves_and_with_jitter_for_one_sample():
    scene = tt.scene_from_mesh(*SQUARE)
    camera = Camera(8, 8)
    still, jittered = PrimaryHits(scene, camera), PrimaryHits(scene, camera, True)
    for hits in (still, jittered):
        for seed, index in ((0, 0), (0, 0), (0, 1), (1, 1)):
            hits.bring_up_to_date(seed, index)
    assert (still.traces, jittered.traces) == (1, 3)
    camera.set_camera_parameters(fov=40)
    for hits in (still, jittered):
        hits.bring_up_to_date(1, 1)
    assert (still.traces, jittered.traces) == (2, 4)
