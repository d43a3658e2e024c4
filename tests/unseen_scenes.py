"""Scenes of squares and spheres with lamps, mirrors and glass, for the tests of ``unseen``."""

import numpy as np

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material

SIZE = 24
KD, KE = 0.6, 2e4
VIEW = {"eye": (0, 4, 3), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 40.0}


def flat(centre, half, facing=1.0):
    """A square that looks along ±y."""
    x, y, z = centre
    s = half * facing
    return np.array([[x - s, y, z + half], [x + s, y, z + half], [x + s, y, z - half], [x - s, y, z - half]])


def upright(x, half, facing=1.0):
    """A square that looks along ±x."""
    s = half * facing
    return np.array([[x, 0, s], [x, 0, -s], [x, 2 * half, -s], [x, 2 * half, s]])


MATERIALS = [
    Material("floor", Kd=(KD,) * 3),
    Material("lamp", Kd=(0,) * 3, Ke=(KE,) * 3),
    Material("mirror", Kd=(1,) * 3, Ns=1e15),
    Material("glass", Kd=(0,) * 3, d=0.0, Ni=1.5),
    Material("dim lamp", Kd=(0,) * 3, Ke=(5.0,) * 3),
]


def scene(parts, ids, spheres=(), sphere_material=3, **options):
    """Squares with materials, and spheres (x, y, z, radius)."""
    faces = [[4 * k + i for i in corner] for k in range(len(parts)) for corner in ((0, 1, 2), (0, 2, 3))]
    mesh = Mesh(
        vertices=np.concatenate(parts),
        faces=np.array(faces, np.int32),
        face_materials=np.repeat(ids, 2).astype(np.int32),
        materials=MATERIALS,
        spheres=np.array(spheres, float).reshape(-1, 4),
        sphere_materials=np.full(len(spheres), sphere_material, np.int32),
    )
    return tt.SceneData(mesh, view=VIEW, **options)
