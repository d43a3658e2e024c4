"""Malformed glTF files: each is one line that names the file and the place in it, at once, and never another error."""

import base64
import json
import time

import numpy as np
import pytest
from shapes import SQUARE

from taichi_tracer.files import read
from taichi_tracer.files.gltf_checks import LIGHTS
from taichi_tracer.system.errors import InputError

SECONDS = 1.0  # for each
PART = ("meshes", 0, "primitives", 0)
LOOK = ("materials", 0, "pbrMetallicRoughness")


def document():
    """The JSON of a textured square with a light."""
    arrays = np.asarray(SQUARE[0], "<f4"), np.asarray(SQUARE[1], "<u4"), np.zeros((4, 2), "<f4")
    starts = np.cumsum([0, *(array.nbytes for array in arrays)]).tolist()
    text = base64.b64encode(b"".join(array.tobytes() for array in arrays)).decode()
    kinds = (5126, 4, "VEC3"), (5125, 6, "SCALAR"), (5126, 4, "VEC2")
    part = {"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1, "material": 0}
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "children": [1]}, {"extensions": {LIGHTS: {"light": 0}}}],
        "meshes": [{"primitives": [part]}],
        "materials": [{"name": "look", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0, "sampler": 0}],
        "images": [{"uri": "data:image/png;base64," + base64.b64encode(b"no picture").decode()}],
        "samplers": [{}],
        "extensions": {LIGHTS: {"lights": [{"type": "spot"}]}},
        "accessors": [
            {"bufferView": k, "componentType": kind, "count": count, "type": of}
            for k, (kind, count, of) in enumerate(kinds)
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": array.nbytes}
            for start, array in zip(starts, arrays, strict=False)
        ],
        "buffers": [{"byteLength": starts[-1], "uri": f"data:;base64,{text}"}],
    }


def changed(*path):
    """``document()`` with another value, which comes last, at a path."""
    *keys, last, value = path
    content = inner = document()
    for key in keys:
        inner = inner[key]
    inner[last] = value
    return content


def light(**values):
    return changed("extensions", LIGHTS, "lights", 0, {"type": "spot", **values})


@pytest.fixture
def mesh_of(tmp_path):
    """Reads a document as the file a.gltf, in time."""

    def read_document(content):
        (tmp_path / "a.gltf").write_text(json.dumps(content))
        start = time.perf_counter()
        try:
            return read(tmp_path / "a.gltf")
        finally:
            assert time.perf_counter() - start < SECONDS

    return read_document


WRONG = {
    "no object": ([1, 2], "the file: an object is needed, not [1, 2]"),
    "extensions in a number": ({"extensionsRequired": 5}, "extensionsRequired must be a list, not 5"),
    "accessor out of range": (changed(*PART, "indices", 9), "primitives[0].indices is 9, but accessors has 3 entries"),
    "negative accessor": (changed(*PART, "indices", -1), "primitives[0].indices is -1, but accessors has 3 entries"),
    "accessor in words": (changed(*PART, "indices", "one"), "primitives[0].indices is 'one', but accessors has 3"),
    "no position": (changed(*PART, "attributes", {}), "primitives[0]: POSITION is missing"),
    "list of attributes": (changed(*PART, "attributes", [0]), "attributes: an object is needed, not [0]"),
    "no primitives": (changed("meshes", 0, {}), "meshes[0]: primitives is missing"),
    "unknown mode": (changed(*PART, "mode", 77), "primitives[0]: mode 77 is unknown"),
    "material out of range": (changed(*PART, "material", 9), "material is 9, but materials has 1 entries"),
    "negative material": (changed(*PART, "material", -1), "material is -1, but materials has 1 entries"),
    "flat positions": (changed(*PART, "attributes", {"POSITION": 2}), "POSITION must be VEC3, not VEC2"),
    "too few coordinates": (changed("accessors", 2, "count", 2), "2 entries of TEXCOORD_0 for 4 vertices"),
    "indices that are no whole numbers": (
        changed("accessors", 1, "componentType", 5126),
        "indices must be whole numbers, not SCALAR of 5126",
    ),
    "triangles with a corner missing": (
        changed("accessors", 1, "count", 5),
        "5 corners are not those of whole triangles",
    ),
    "wrong componentType": (changed("accessors", 0, "componentType", 5127), "accessors[0]: componentType 5127 is unkn"),
    "wrong type": (changed("accessors", 0, "type", "VEC5"), "accessors[0]: type 'VEC5' is unknown"),
    "negative count": (changed("accessors", 0, "count", -4), "count must be a whole number of at least 0, not -4"),
    "huge count": (
        changed("accessors", 0, "count", 10**12),
        "ends at byte 12000000000000 of a buffer view of 48 bytes",
    ),
    "huge count without numbers": (
        changed("accessors", 0, {"componentType": 5126, "count": 10**13, "type": "VEC3"}),
        "POSITION is sparse or has no bufferView",
    ),
    "sparse": (changed("accessors", 0, "sparse", {"count": 1}), "POSITION is sparse or has no bufferView"),
    "view out of range": (
        changed("accessors", 0, "bufferView", 7),
        "accessors[0].bufferView is 7, but bufferViews has",
    ),
    "stride of 0": (changed("bufferViews", 0, "byteStride", 0), "bufferViews[0]: byteStride must be above 0"),
    "view beyond its buffer": (
        changed("bufferViews", 0, "byteOffset", 10**9),
        "bufferViews[0]: it ends at byte 1000000048 of a buffer of 104 bytes",
    ),
    "missing buffer": (changed("buffers", []), "bufferViews[0].buffer is 0, but buffers has 0 entries"),
    "buffer without a name": (changed("buffers", [{"byteLength": 104}]), "buffers[0]: uri is missing"),
    "buffer of a missing file": (
        changed("buffers", [{"byteLength": 104, "uri": "none.bin"}]),
        "it needs the file none.bin, which is not beside it",
    ),
    "buffer of a device": (changed("buffers", [{"byteLength": 104, "uri": "/dev/zero"}]), "this is a device"),
    "buffer of a folder": (changed("buffers", [{"byteLength": 104, "uri": "."}]), "this is a folder"),
    "short buffer": (
        changed("buffers", [{"byteLength": 104, "uri": "data:;base64,AAAA"}]),
        "a buffer is shorter than it says",
    ),
    "sampler out of range": (changed("textures", 0, "sampler", 9), "textures[0].sampler is 9, but samplers has 1"),
    "image out of range": (changed("textures", 0, "source", 9), "textures[0].source is 9, but images has 1 entries"),
    "texture in words": (changed(*LOOK, "baseColorTexture", 3), "baseColorTexture: an object is needed, not 3"),
    "metalness in words": (changed(*LOOK, "metallicFactor", "shiny"), "metallicFactor must be a finite number from 0"),
    "roughness of 7": (changed(*LOOK, "roughnessFactor", 7), "roughnessFactor must be a finite number from 0 to 1"),
    "roughness of NaN": (
        changed(*LOOK, "roughnessFactor", np.nan),
        "roughnessFactor must be a finite number from 0 to",
    ),
    "a look in words": (changed(*LOOK, "shiny"), "pbrMetallicRoughness: an object is needed, not 'shiny'"),
    "two colours": (
        changed(*LOOK, "baseColorFactor", [1, 2]),
        "baseColorFactor must be 4 finite numbers of at least 0",
    ),
    "negative colour": (changed(*LOOK, "baseColorFactor", [-1, 0, 0, 1]), "baseColorFactor must be 4 finite numbers"),
    "infinite emission": (
        changed("materials", 0, "emissiveFactor", [np.inf, 0, 0]),
        "materials[0]: emissiveFactor must be 3 finite numbers of at least 0",
    ),
    "cutoff of NaN": (changed("materials", 0, "alphaCutoff", np.nan), "alphaCutoff must be a finite number"),
    "cutoff in words": (changed("materials", 0, "alphaCutoff", "x"), "alphaCutoff must be a finite number"),
    "unknown mode of alpha": (changed("materials", 0, "alphaMode", 5), "materials[0]: alphaMode 5 is unknown"),
    "light out of range": (
        changed("extensions", LIGHTS, "lights", []),
        "nodes[1].KHR_lights_punctual.light is 0, but lights has 0 entries",
    ),
    "intensity in words": (light(intensity="bright"), "lights[0]: intensity must be a finite number of at least 0"),
    "negative intensity": (light(intensity=-1), "lights[0]: intensity must be a finite number of at least 0, not -1"),
    "colour of a light in words": (light(color="red"), "lights[0]: color must be 3 finite numbers of at least 0"),
    "negative range": (light(range=-3), "lights[0]: range must be a finite number of at least 0, not -3"),
    "range of 0": (light(range=0), "lights[0]: range must be above 0"),
    "outer cone within the inner one": (
        light(spot={"innerConeAngle": 0.6, "outerConeAngle": 0.5}),
        "lights[0].spot: innerConeAngle 0.6 must be less than outerConeAngle 0.5",
    ),
    "cone of 0": (light(spot={"outerConeAngle": 0}), "innerConeAngle 0 must be less than outerConeAngle 0"),
    "cone behind the light": (
        light(spot={"outerConeAngle": 3}),
        "outerConeAngle must be a finite number from 0 to 1.571",
    ),
    "node out of range": (changed("nodes", 0, "children", [9]), "nodes[0].children is 9, but nodes has 2 entries"),
    "mesh out of range": (changed("nodes", 0, "mesh", 9), "nodes[0].mesh is 9, but meshes has 1 entries"),
    "scene out of range": (changed("scene", 5), "scene is 5, but scenes has 1 entries"),
    "short matrix": (changed("nodes", 0, "matrix", [1, 2, 3]), "nodes[0]: matrix must be 16 finite numbers"),
    "scale in words": (changed("nodes", 0, "scale", "big"), "nodes[0]: scale must be 3 finite numbers, not 'big'"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_mistake_is_one_line_that_names_file_and_place(name, mesh_of):
    content, message = WRONG[name]
    with pytest.raises(InputError) as caught:
        mesh_of(content)
    assert message in str(caught.value)
    assert "a.gltf: " in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "notes"),
    [
        (document(), ["the baseColorTexture of material 'look' cannot be read, and is not used"]),
        (
            changed("images", [{"uri": "none.png"}]),
            ["the baseColorTexture of material 'look' cannot be read, and is not used"],
        ),
        (
            changed("images", [{"uri": "/dev/zero"}]),
            ["the baseColorTexture of material 'look' cannot be read, and is not used"],
        ),
        (
            changed(*LOOK, "baseColorTexture", {"index": 9}),
            ["the baseColorTexture of material 'look' cannot be read, and is not used"],
        ),
        (
            changed(*LOOK, {}) | {"extensions": {LIGHTS: {"lights": [{"type": "area", "name": "sky"}]}}},
            ["light 'sky' is not used: its type or its place is unknown"],
        ),
        (
            changed(*LOOK, {}) | {"extensions": {LIGHTS: {"lights": [{"type": "point", "range": 3}]}}},
            ["light 'point': its range is not used, so that it shines farther"],
        ),
    ],
)
def test_what_is_left_out_is_told_and_the_rest_is_read(content, notes, mesh_of):
    mesh = mesh_of(content)
    np.testing.assert_array_equal(mesh.faces, SQUARE[1])
    assert [note.split("a.gltf: ")[1] for note in mesh.notes] == notes


def test_ids_of_vertices_that_are_not_there_are_named(mesh_of):
    """Before their texture coordinates are looked up."""
    content = document()
    raw = bytearray(base64.b64decode(content["buffers"][0]["uri"].split(",")[1]))
    raw[48:52] = (77).to_bytes(4, "little")
    content["buffers"][0]["uri"] = "data:;base64," + base64.b64encode(raw).decode()
    with pytest.raises(InputError, match=r"a\.gltf: triangle 0 has vertex index 77, which is out of range"):
        mesh_of(content)


def test_nodes_in_a_circle_end(mesh_of):
    nodes = [{"mesh": 0, "children": [1]}, {"children": [0, 1]}]
    assert len(mesh_of(changed("nodes", nodes)).faces) == 2


def test_coordinates_of_whole_numbers_are_told(mesh_of):
    content = changed("accessors", 2, {"bufferView": 2, "componentType": 5123, "count": 4, "type": "VEC2"})
    mesh = mesh_of({**content, **changed(*LOOK, {})} | {"accessors": content["accessors"]})
    assert mesh.corner_uv is None
    (note,) = mesh.notes
    assert note.endswith("a.gltf: texture coordinates of whole numbers are not read: 1 of 1 parts have none")
