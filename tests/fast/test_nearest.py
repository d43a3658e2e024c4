"""Fast brute force: the answers of the plain form, whatever the geometry has, and hits that are described once."""

import numpy as np
from shapes import SQUARE, lattice, random_spheres, soup, with_spheres

import taichi_tracer as tt
from taichi_tracer.fast.nearest import FastBruteForce, FastIntersector
from taichi_tracer.geometry import Mesh
from taichi_tracer.ray_intersector import RayIntersector


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
