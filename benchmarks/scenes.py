"""The scenes of ``direct``, ``paths`` and ``error``: spheres on a floor, and skies."""

import numpy as np

import taichi_tracer as tt
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material

SKY_SIZE, SUN_DEGREES, SUN_RADIANCE = (64, 128), 5.0, 20.0
SPHERES_VIEW = {"eye": (0, 1.4, 3.6), "at": (0, 0.4, 0), "up": (0, 1, 0), "fov": 45.0}
DIRECT = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1}  # Mitsuba's MIS


def sun_and_sky() -> np.ndarray:
    """(h, w, 3) radiance: a sky that is brighter at the horizon, and a sun that stands high behind the camera."""
    height, width = SKY_SIZE
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    elevation, azimuth = np.pi * (0.5 - v), 2 * np.pi * (u - 0.5)
    d = np.stack([np.cos(elevation) * np.cos(azimuth), np.sin(elevation), np.cos(elevation) * np.sin(azimuth)], -1)
    sky = (1 - 0.6 * np.abs(d[..., 1:2])) * np.array([0.5, 0.7, 1.0])
    sun = np.array([0.5, 1.0, 0.8]) / np.linalg.norm([0.5, 1.0, 0.8])
    sky[d @ sun > np.cos(np.radians(SUN_DEGREES))] += SUN_RADIANCE
    return sky


def three_spheres() -> Mesh:
    """Spheres with Ns 1, 20 and 200 on a floor."""
    materials = [Material("floor", Kd=(0.5, 0.5, 0.5))]
    materials += [Material(f"Ns {ns}", Kd=(0.8, 0.7, 0.6), Ns=ns) for ns in (1, 20, 200)]
    floor = np.array([[-6, 0, 6], [6, 0, 6], [6, 0, -6], [-6, 0, -6]], float)
    return Mesh(
        vertices=floor,
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        face_materials=np.zeros(2, np.int32),
        materials=materials,
        spheres=np.array([[-1.2, 0.5, 0, 0.5], [0, 0.5, 0, 0.5], [1.2, 0.5, 0, 0.5]]),
        sphere_ids=np.array([2, 3, 4], np.int32),
        sphere_materials=np.array([1, 2, 3], np.int32),
    )


def spheres_on_floor(environment) -> tt.SceneData:
    """The three spheres on a floor."""
    return tt.SceneData(three_spheres(), view=SPHERES_VIEW, environment=environment)


def spheres_under_sun() -> tt.SceneData:
    """Three spheres on a floor, under sun and sky."""
    return spheres_on_floor(sun_and_sky())


def their_sky() -> np.ndarray:
    """The environment that is shipped as "studio"."""
    return np.load(shipped_environments()["studio"])
