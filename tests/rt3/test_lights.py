"""The lights of RT3 documents: what an element means, what is wrong in it, and that it is written again."""

import numpy as np
import pytest
from rt3_text import document, read

import taichi_tracer as tt
from taichi_tracer.rt3.write import as_rt3

ALL = """<light_source type="ambient" L="0.1 0.2 0.3"/>
<light_source type="directional" L="1 1 1" scale="2" from="1 1 1" to="0 0 0"/>
<light_source type="point" I="1 2 3" scale="2 1 0" from="1 2 3" attenuation="1 0.5 0.25"/>
<light_source type="spot" I="4" from="0 0 5" to="0 0 0" cutoff="40" falloff="10"/>"""


def lights(folder, world):
    return read(folder, document(world)).lights


def test_each_kind_has_its_numbers(tmp_path):
    ambient, sun, point, spot = lights(tmp_path, ALL)
    assert ambient.intensity == (0.1, 0.2, 0.3)
    assert (sun.irradiance, sun.direction) == ((2, 2, 2), (-1, -1, -1))
    assert (point.position, point.intensity, point.attenuation) == ((1, 2, 3), (2, 2, 0), (1, 0.5, 0.25))
    assert (spot.intensity, spot.attenuation) == (
        (4, 4, 4),
        (1, 0, 0),
    )  # no attenuation is said
    assert (spot.position, spot.target, spot.cutoff, spot.falloff) == ((0, 0, 5), (0, 0, 0), 40, 10)


def test_the_transform_moves_lights(tmp_path):
    world = '<translate value="10 0 0"/><rotate angle="90" axis="0 0 1"/>'
    world += '<light_source type="point" I="1" from="1 0 0"/>'
    world += '<light_source type="directional" L="1" from="0 0 0" to="1 0 0"/>'
    point, sun = lights(tmp_path, world)
    np.testing.assert_allclose(point.position, [10, 1, 0], atol=1e-12)
    np.testing.assert_allclose(sun.direction, [0, 1, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("element", "told"),
    [
        ('type="sun" L="1"', "'sun'"),
        ('type="ambient"', "needs the attribute L"),
        ('type="ambient" L="-1 0 0"', "must not be negative"),
        ('type="ambient" L="1" scale="-1"', "must not be negative"),
        ('type="ambient" L="1" I="1"', "mean the same"),
        ('type="ambient" L="1 2"', "L must be 1 or 3 finite numbers"),
        ('type="ambient" L="1e400 0 0"', "finite"),
        ('type="directional" L="1" from="1 2 3" to="1 2 3"', "direction must have a length"),
        ('type="point" I="1"', "needs the attribute from"),
        ('type="point" I="1" from="0 0"', "from must be 3 finite numbers"),
        ('type="point" I="1" from="0 0 0" attenuation="0 0 0"', "one number of attenuation must be above 0"),
        (
            'type="point" I="1" from="0 0 0" attenuation="1 -1 0"',
            "attenuation must be three finite numbers of at least 0",
        ),
        ('type="spot" I="1" from="0 0 1"', "needs the attribute to"),
        ('type="spot" I="1" from="0 0 1" to="0 0 1"', "the way to its target must have a length"),
        ('type="spot" I="1" from="0 0 1" to="0 0 0" cutoff="10" falloff="20"', "0 <= falloff <= cutoff"),
        ('type="spot" I="1" from="0 0 1" to="0 0 0" cutoff="-1"', "0 <= falloff <= cutoff"),
        ('type="spot" I="1" from="0 0 1" to="0 0 0" cutoff="a"', "cutoff must be a finite number"),
    ],
)
def test_a_wrong_light_is_told_with_its_line(tmp_path, element, told):
    with pytest.raises(tt.InputError, match=r"scene\.xml:6: ") as error:
        lights(tmp_path, f"<light_source {element}/>")
    assert told in str(error.value)
    assert "\n" not in str(error.value)


def test_lights_stand_in_the_world(tmp_path):
    text = document("").replace("<world_begin/>", '<light_source type="ambient" L="1"/><world_begin/>')
    with pytest.raises(tt.InputError, match="belongs into the world"):
        read(tmp_path, text)


def test_what_is_written_is_read_again(tmp_path):
    first = read(tmp_path, document(ALL + '<material type="blinn" mirror="0.5"/><object type="sphere" radius="1"/>'))
    path = tmp_path / "again.xml"
    again = read(tmp_path, as_rt3(first, path), "again.xml")
    assert [repr(light) for light in again.lights] == [repr(light) for light in first.lights]
    assert again.mesh.materials[0].Km == (0.5, 0.5, 0.5)


def test_scenes_have_the_lights_of_the_document_and_others_beside(tmp_path, f32):
    path = tmp_path / "scene.xml"
    path.write_text(document('<light_source type="ambient" L="1"/><object type="sphere" radius="1"/>'))
    scene = tt.load_scene_data(path, lights=[tt.PointLight()])
    assert [light.name for light in scene.lights] == ["ambient", "point"]
