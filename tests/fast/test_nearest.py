"""Fast brute force: the answers of the plain form, whatever the geometry has, and hits that are described once."""

import numpy as np
import pytest
from compare import assert_same_answers
from shapes import SQUARE, lattice, random_rays, random_spheres, soup, with_spheres
from support import long_except

import taichi_tracer as tt
from taichi_tracer.fast.nearest import FastBruteForce, FastIntersector
from taichi_tracer.geometry import Mesh
from taichi_tracer.ray_intersector import BruteForceRayIntersector, RayIntersector


def everything(rng):
    """Culled triangles and spheres, with vertex normals and two materials."""
    vertices, faces = soup(rng, 80)
    return with_spheres(
        random_spheres(rng, 40, 0.8),
        vertices * 2,
        faces,
        normals=rng.normal(size=(240, 3)),
        face_normals=np.where(np.arange(80)[:, None] % 3 == 0, -1, faces),
        face_materials=(np.arange(80) % 2).astype(np.int32),
        sphere_materials=(np.arange(40) % 2).astype(np.int32),
        materials=[tt.Material("a"), tt.Material("b")],
        face_culls=np.arange(80) % 4 != 0,
    )


MESHES = {
    "soup": lambda rng: Mesh(*soup(rng, 100)),
    "lattice": lambda rng: Mesh(*lattice(rng, 50)),
    "culled triangles": lambda rng: Mesh(*soup(rng, 100), face_culls=np.arange(100) % 2 == 0),
    "spheres alone": lambda rng: with_spheres(random_spheres(rng, 30)),
    "everything": everything,
}


@pytest.mark.long
@pytest.mark.parametrize("name", long_except(MESHES, "lattice", "everything"))
def test_it_answers_as_the_plain_form(precision, name, rng):
    mesh = MESHES[name](rng)
    plain, fast = (tt.SceneData(mesh, intersector="brute_force", fast=fast) for fast in (False, True))
    assert type(plain.ray_intersector) is BruteForceRayIntersector
    assert type(fast.ray_intersector) is FastBruteForce
    origins, directions = random_rays(rng, 6_000, reach=2)
    hits = assert_same_answers(plain, fast, origins, directions)
    assert 0.01 < hits.is_hit.mean() < 0.99
    interval = {"t_min": 0.5, "t_max": np.where(hits.is_hit, hits.distance, 1.5)}
    assert_same_answers(plain, fast, origins, directions, **interval)


@pytest.mark.long
def test_only_triangles_with_two_sides_are_plain_geometry(f32, rng):
    kinds = {name: tt.SceneData(make(rng)).ray_intersector.is_plain_geometry for name, make in MESHES.items()}
    assert [name for name, is_plain in kinds.items() if is_plain] == ["soup", "lattice"]


def test_every_fast_form_names_the_plain_one_that_it_stands_in_for():
    for form in (FastBruteForce, *FastIntersector.__subclasses__()):
        assert issubclass(form.stands_in_for, RayIntersector)
        assert not issubclass(form.stands_in_for, FastIntersector)
        assert form.name == form.stands_in_for.name


def test_ties_go_to_the_first(f32):
    mesh = Mesh(SQUARE[0], np.concatenate([SQUARE[1]] * 5))
    assert tt.SceneData(mesh, intersector="brute_force").intersect([0.5, 0.25, 5], [0, 0, -1]).triangle_id[0] == 0
    spheres = tt.SceneData(with_spheres([(0, 0, 0, 1)] * 5), intersector="brute_force")
    assert spheres.intersect([0, 0, 5], [0, 0, -1]).triangle_id[0] == 0
