"""What is read of glTF files beside triangles: lights in the place of their nodes, and the samplers of textures."""

import base64
import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from taichi_tracer.files.readers.gltf import FAN, LIGHTS, STRIP, Gltf, read_gltf, triangles_of
from taichi_tracer.system.errors import InputError

TURN = [0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)]  # a quarter about y: −z becomes −x


def lights(nodes, known, **content):
    """((name, arguments) of the lights, the notes) of a glTF with these nodes."""
    content |= {"nodes": nodes, "extensions": {LIGHTS: {"lights": known}}}
    notes = []
    return read_gltf(json.dumps(content).encode(), Path("a.gltf"), notes).lights, notes


def node(light=0, **options):
    return {"extensions": {LIGHTS: {"light": light}}, **options}


def test_a_light_has_the_place_of_its_node_and_of_those_above():
    nodes = [
        {"children": [1], "translation": [10, 0, 0], "scale": [2, 2, 2]},
        node(translation=[1, 2, 3], rotation=TURN),
    ]
    kinds = [{"type": "spot", "intensity": 5, "color": [1, 0.5, 0], "spot": {"outerConeAngle": 0.5}}]
    ((name, values),), notes = lights(nodes, kinds, scenes=[{"nodes": [0]}])
    assert (name, notes) == ("spot", [])
    np.testing.assert_allclose(values["position"], [12, 4, 6])
    np.testing.assert_allclose(values["target"] - values["position"], [-2, 0, 0], atol=1e-12)
    np.testing.assert_allclose(values["intensity"], [5, 2.5, 0])
    assert (values["cutoff"], values["falloff"]) == (pytest.approx(np.degrees(0.5)), 0)


def test_matrices_are_given_by_columns():
    matrix = np.eye(4)
    matrix[:3, 3] = [4, 5, 6]
    ((name, values),), _ = lights([node(matrix=matrix.T.ravel().tolist())], [{"type": "point"}])
    assert name == "point"
    np.testing.assert_allclose(values["position"], [4, 5, 6])
    np.testing.assert_allclose(values["intensity"], [1, 1, 1])


def test_a_sun_shines_along_minus_z():
    ((_, values),), _ = lights([node()], [{"type": "directional", "intensity": 2}])
    np.testing.assert_allclose(values["direction"], [0, 0, -1])
    np.testing.assert_allclose(values["irradiance"], [2, 2, 2])


def test_what_cannot_be_used_is_told():
    nodes = [node(0, children=[1, 2]), node(1, scale=[0, 0, 0]), node(2)]
    found, notes = lights(nodes, [{"type": "area"}, {"type": "point", "name": "gone"}, {"type": "point"}])
    assert len(found) == 1
    assert notes == [
        "light 'area' is not used: its type or its place is unknown",
        "light 'gone' is not used: its type or its place is unknown",
    ]


def test_a_view_behind_the_end_of_its_buffer_is_an_error():
    """The numbers are not those of other memory."""
    content = {"nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}]}
    content |= {"accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}]}
    content |= {"bufferViews": [{"buffer": 0, "byteOffset": 4, "byteLength": 36}]}
    content |= {"buffers": [{"byteLength": 40, "uri": "data:;base64,AAAA"}]}
    with pytest.raises(InputError, match="the file is cut short: buffer view 0 has no bytes"):
        read_gltf(json.dumps(content).encode(), Path("a.gltf"), [])


@pytest.mark.parametrize(
    ("code", "wrap"), [(33071, "clamp"), (33648, "mirror"), (10497, "repeat"), (None, "repeat"), (5, "repeat")]
)
def test_a_sampler_says_what_lies_beyond_a_picture(code, wrap):
    sampler = {} if code is None else {"wrapS": code, "wrapT": 33071}
    look = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    image = io.BytesIO()
    Image.new("RGB", (1, 1)).save(image, "PNG")
    uri = "data:image/png;base64," + base64.b64encode(image.getvalue()).decode()
    content = {"materials": [look], "textures": [{"sampler": 0, "source": 0}], "samplers": [sampler]}
    content["images"] = [{"uri": uri}]
    material, _ = Gltf(content, None, Path("a.gltf"), []).material(0, False)
    assert material.map_Kd.wrap == (wrap, "repeat" if code is None else "clamp")


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_strips_and_fans_have_the_triangles_of_the_format(count):
    """(v0, v1, v2), (v1, v3, v2), … and (v1, v2, v0), (v2, v3, v0), …"""
    ids = np.array([7, 3, 9, 4, 5])[: count + 2]
    strip = [[ids[i], ids[i + 1 + i % 2], ids[i + 2 - i % 2]] for i in range(count)]
    fan = [[ids[i + 1], ids[i + 2], ids[0]] for i in range(count)]
    np.testing.assert_array_equal(triangles_of(ids, STRIP), np.reshape(strip, (-1, 3)))
    np.testing.assert_array_equal(triangles_of(ids, FAN), np.reshape(fan, (-1, 3)))
