"""The parts that a scene is made of."""

import numpy as np
import pytest
import taichi as ti
from shapes import SQUARE, sphere, with_spheres

import taichi_tracer as tt
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.geometry import Mesh
from taichi_tracer.scene_parts import FEW_LAMPS, blockers_of, brdfs_of, lamp_choice_of
from taichi_tracer.system.registry import PARTS

pytestmark = pytest.mark.usefixtures("f32")


@ti.data_oriented
class Velvet(Diffuse):
    """A BRDF of a user's own, for every material."""

    name = "velvet"

    def describes(self, material, dtype):
        return True


def test_the_brdfs_that_were_given_come_last_the_first_of_them_at_the_very_end():
    """Of those that describe a material, the last is taken."""
    first, second = Velvet(), Velvet()
    known = brdfs_of([first, second])
    assert known[-2:] == [second, first]
    assert known[:-2] == PARTS.all("BRDF")
    assert brdfs_of(["phong"])[-1] is PARTS.find("BRDF", "phong")
    assert len(brdfs_of(["phong"])) == len(PARTS.all("BRDF"))
    scene = tt.scene_from_mesh(*SQUARE, brdfs=[Velvet])
    assert [scene.material_library.brdfs[i].name for i in scene.effects.brdfs] == ["velvet"]


def test_a_lamp_choice_suits_the_number_of_lamps_and_belongs_to_one_scene():
    few, many = (lamps(count) for count in (FEW_LAMPS, FEW_LAMPS + 1))
    assert lamp_choice_of(None, few).name == "power"
    assert lamp_choice_of(None, many).name == "hierarchy"
    assert lamp_choice_of("area", many).name == "area"
    assert lamp_choice_of(None, few) is not lamp_choice_of(None, few)


def lamps(count: int) -> Mesh:
    """A mesh of triangles that all emit."""
    return Mesh(np.eye(3), np.tile([[0, 1, 2]], (count, 1)), materials=[tt.Material(Ke=(1, 1, 1))])


def test_what_a_ray_can_hit_is_all_unless_the_package_can_tell():
    convex, flat = Mesh(*sphere(8, 4)), Mesh(*SQUARE)
    assert blockers_of(convex, tt.BVHRayIntersector, "watertight") == "backs"
    assert blockers_of(flat, tt.BVHRayIntersector, "watertight") == "none"
    assert blockers_of(flat, Students, "watertight") == "all"
    assert blockers_of(with_spheres([(0, 0, 0, 1), (2, 0, 0, 1)]), tt.BVHRayIntersector, "watertight") == "all"
    assert blockers_of(with_spheres([(0, 0, 0, 1)]), tt.BVHRayIntersector, "watertight") == "backs"


class Students(tt.BVHRayIntersector):
    """An intersector of which the package does not know what it finds."""

    @ti.func
    def query_ray(self, ray):
        """Another answer."""
        return tt.no_hit()
