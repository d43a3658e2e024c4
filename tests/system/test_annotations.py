"""Classes as annotations of the arguments of Taichi functions."""

import copy
import pickle

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.materials import Material


@ti.func
def red(material: Material, camera: tt.Camera, ray: tt.Ray, hit: tt.HitData):
    return material.Kd.x + camera.eye.y + ray.origin.z + hit.distance


@ti.kernel
def red_of(scene: ti.template(), camera: ti.template(), i: int) -> float:
    return red(scene.material_library.materials[i], camera, tt.Ray(origin=tm.vec3(0.5)), tt.HitData(distance=0.25))


def test_the_classes_that_handouts_write_are_annotations(f32):
    scene = tt.scene_from_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], color=(0.5, 0, 0))
    assert red_of(scene, tt.Camera(4, 4, eye=(0, 2, 1)), 0) == 0.5 + 2 + 0.5 + 0.25


def test_they_are_classes_as_before():
    material = Material(Kd=(1, 0, 0))
    assert isinstance(material, Material)
    assert isinstance(Material, type)
    assert type(material) is Material
    assert pickle.loads(pickle.dumps(material)) == copy.deepcopy(material) == material
    assert repr(Material) == "<class 'taichi_tracer.materials.Material'>"
