"""Arrays with colours, materials and normals: each means what it says, and what does not fit is one clear line."""

import numpy as np
import pytest
from shapes import SQUARE

from taichi_tracer.files.meshes import mesh_from_arrays, with_appearance
from taichi_tracer.geometry import check
from taichi_tracer.materials import Material
from taichi_tracer.system.errors import InputError

UP = np.tile([0.0, 0.0, 2.0], (4, 1))


def dressed_square(**options):
    return with_appearance(mesh_from_arrays(*SQUARE), **options)


def test_a_colour_is_the_reflectance():
    mesh = dressed_square(color=(0.5, 0.25, 1))
    assert mesh.materials == [Material(Kd=(0.5, 0.25, 1.0))]
    assert mesh.face_materials.tolist() == [0, 0]


def test_a_material_or_several_are_taken_as_they_are():
    red, lamp = Material("red", Kd=(1, 0, 0)), Material("lamp", Ke=(9, 9, 9))
    assert dressed_square(material=lamp).materials == [lamp]
    several = dressed_square(material=[red, lamp], face_materials=[1, 0])
    assert [several.materials[i].name for i in several.face_materials] == ["lamp", "red"]
    colours = dressed_square(color=[[1, 0, 0], [0, 1, 0]], face_materials=np.array([1, 1], np.uint8))
    assert [colours.materials[i].Kd for i in colours.face_materials] == [(0, 1, 0), (0, 1, 0)]


def test_normals_are_those_of_vertices_or_of_corners():
    by_vertex = dressed_square(normals=UP)
    assert by_vertex.normals[by_vertex.face_normals].tolist() == np.tile([0, 0, 2], (2, 3, 1)).tolist()
    corners = np.arange(18.0).reshape(2, 3, 3)
    by_corner = dressed_square(normals=corners)
    assert by_corner.normals[by_corner.face_normals].tolist() == corners.tolist()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"color": (255, 0, 0)}, "color must be numbers from 0 to 1, not 255: divide colours of 8 bits by 255"),
        ({"color": (0, -0.5, 0)}, "color must be numbers from 0 to 1, not -0.5"),
        ({"color": (0, np.nan, 0)}, "color must be numbers from 0 to 1, not nan"),
        ({"color": 0.5}, "color must be three numbers, or have the shape (m, 3), not ()"),
        ({"color": "red"}, "color must be an array of numbers, not str"),
        ({"color": (1, 1, 1), "material": Material()}, "give color or material, not both"),
        ({"material": "red"}, "material must be a Material, or a list of them, not 'red'"),
        ({"material": []}, "or a list of them, not []"),
        ({"material": [Material(), Material()]}, "2 materials need face_materials"),
        ({"color": np.zeros((3, 3))}, "3 materials need face_materials"),
        ({"face_materials": [0, 1]}, "face_materials[1] is 1, which is out of range (0 to 0)"),
        ({"face_materials": [0, -1]}, "face_materials[1] is -1"),
        ({"face_materials": [0]}, "face_materials must have the shape (2,), not (1,)"),
        ({"face_materials": [0.0, 0.5]}, "face_materials must be whole numbers, not float64"),
        ({"normals": UP[:3]}, "normals must have the shape (4, 3), one per vertex, or (2, 3, 3), one per corner"),
        ({"normals": np.where(np.eye(4, 3) > 0, np.inf, 1)}, "normals must be finite numbers, not inf"),
    ],
)
def test_what_does_not_fit_is_one_line_with_its_value(options, message):
    with pytest.raises(InputError) as error:
        check(dressed_square(**options))
    assert message in str(error.value)
    assert str(error.value).startswith("mesh: ")
    assert "\n" not in str(error.value)
