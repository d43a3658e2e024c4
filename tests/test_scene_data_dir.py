"""The shipped scenes are what their README says, and their script remakes them to the byte."""

import io
import json
import struct
import sys
from pathlib import Path
from subprocess import run

import numpy as np
import pytest
from oracles.tiny_obj import read_mtl, read_obj
from PIL import Image

FOLDER = Path(__file__).parent.parent / "scene_data_dir"

OBJ_NAMES = ["cornell_box", "cube", "specular_spheres", "sphere", "torus_knot"]
LIGHT_NAMES = ["caustic_sphere", "many_lights", "veach_plates", "white_room"]  # scenes in which light bounces
SPECULAR = ["diffuse", "phong", "mirror"]

# Cornell Box Data, www.graphics.cornell.edu/online/box/data.html, in millimetres: four corners for each face.
PUBLISHED = {
    "floor": ["552.8 0 0  0 0 0  0 0 559.2  549.6 0 559.2"],
    "back_wall": ["549.6 0 559.2  0 0 559.2  0 548.8 559.2  556 548.8 559.2"],
    "right_wall": ["0 0 559.2  0 0 0  0 548.8 0  0 548.8 559.2"],
    "left_wall": ["552.8 0 0  549.6 0 559.2  556 548.8 559.2  556 548.8 0"],
    "short_box": [
        "130 165 65  82 165 225  240 165 272  290 165 114",
        "290 0 114  290 165 114  240 165 272  240 0 272",
        "130 0 65  130 165 65  290 165 114  290 0 114",
        "82 0 225  82 165 225  130 165 65  130 0 65",
        "240 0 272  240 165 272  82 165 225  82 0 225",
    ],
    "tall_box": [
        "423 330 247  265 330 296  314 330 456  472 330 406",
        "423 0 247  423 330 247  472 330 406  472 0 406",
        "472 0 406  472 330 406  314 330 456  314 0 456",
        "314 0 456  314 330 456  265 330 296  265 0 296",
        "265 0 296  265 330 296  423 330 247  423 0 247",
    ],
    "lamp": ["343 548.8 227  343 548.8 332  213 548.8 332  213 548.8 227"],
}
ROOM = ["floor", "ceiling", "back_wall", "right_wall", "left_wall", "lamp"]


def corners(text):
    return np.array(text.split(), dtype=float).reshape(4, 3)


def read_blob():
    """-> points (n, 3), normals (n, 3), faces (m, 3), in float64"""
    header, data = (FOLDER / "blob.ply").read_bytes().split(b"end_header\n", 1)
    words = header.decode("ascii").split()
    n, m = (int(words[words.index(kind) + 1]) for kind in ("vertex", "face"))
    vertex = np.frombuffer(data, dtype="<f4", count=6 * n).reshape(n, 6).astype(np.float64)
    face = np.frombuffer(data, dtype=[("count", "u1"), ("ids", "<u2", 3)], offset=24 * n)
    assert len(face) == m
    assert (face["count"] == 3).all()
    return vertex[:, :3], vertex[:, 3:], face["ids"].astype(int)


@pytest.fixture(scope="module")
def objs():
    return {name: read_obj(FOLDER / f"{name}.obj") for name in [*OBJ_NAMES, *LIGHT_NAMES]}


@pytest.fixture(scope="module")
def closed_surfaces(objs):
    """Name -> points, triangles."""
    surfaces = {name: (objs[name].vertices, objs[name].triangles()) for name in ("cube", "sphere", "torus_knot")}
    for name in SPECULAR:
        surfaces[name] = objs["specular_spheres"].vertices, objs["specular_spheres"].triangles(name)
    points, _, faces = read_blob()
    surfaces["blob"] = points, faces
    return surfaces


@pytest.fixture(scope="module")
def smooth_surfaces(objs):
    """Name -> points, normals, triangles; vertex i has normal i."""
    surfaces = {n: (objs[n].vertices, objs[n].normals, objs[n].triangles()) for n in OBJ_NAMES if len(objs[n].normals)}
    return {**surfaces, "blob": read_blob()}


def edges_without_twin(triangles):
    """Directed edges whose reverse is not there; each directed edge occurs once."""
    edges = [(a, b) for i in range(3) for a, b in zip(*triangles[:, [i, (i + 1) % 3]].T.tolist(), strict=True)]
    present = set(edges)
    assert len(present) == len(edges)
    return {(a, b) for a, b in edges if (b, a) not in present}


def signed_volume(points, triangles):
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.sum(a * np.cross(b, c)) / 6


def face_normals(points, triangles):
    a, b, c = (points[triangles[:, i]] for i in range(3))
    n = np.cross(b - a, c - a)
    return n / np.linalg.norm(n, axis=1, keepdims=True)


# --- The files --------------------------------------------------------------------------------------------------------


def test_script_remakes_every_file_to_the_byte():
    command = [sys.executable, "-B", str(FOLDER / "make_scenes.py"), "--check"]
    result = run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr


def test_readme_lists_every_scene_and_environment():
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    for path in FOLDER.rglob("*"):
        if path.suffix in (".obj", ".ply", ".glb", ".npy", ".xml"):
            assert f"`{path.relative_to(FOLDER).as_posix()}`" in text


# --- Meshes -----------------------------------------------------------------------------------------------------------


def test_triangle_counts(objs):
    counts = {name: len(objs[name].triangles()) for name in OBJ_NAMES}
    assert counts == {"cornell_box": 38, "cube": 12, "specular_spheres": 2940, "sphere": 5120, "torus_knot": 20000}
    assert [len(objs["specular_spheres"].triangles(name)) for name in SPECULAR] == [980] * 3
    assert len(read_blob()[2]) == 80000


@pytest.mark.parametrize("name", ["cube", "sphere", "torus_knot", "blob", *SPECULAR])
def test_closed_and_facing_outwards(closed_surfaces, name):
    points, triangles = closed_surfaces[name]
    assert not edges_without_twin(triangles)
    assert signed_volume(points, triangles) > 0


@pytest.mark.parametrize("name", ["sphere", "specular_spheres", "torus_knot", "blob"])
def test_normals_are_unit_and_agree_with_the_faces(smooth_surfaces, name):
    points, normals, triangles = smooth_surfaces[name]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=2e-5)
    cosine = np.einsum("tk,tik->ti", face_normals(points, triangles), normals[triangles])
    assert cosine.min() > 0.9


# --- Cornell box ------------------------------------------------------------------------------------------------------


def millimetres(vertices):
    """The inverse of the transform that the file states: x = s (278 - X), y = s Y, z = 1.15 - s Z."""
    s = 2 / 548.8
    return np.stack([278 - vertices[:, 0] / s, vertices[:, 1] / s, (1.15 - vertices[:, 2]) / s], axis=-1)


def test_cornell_faces_have_the_published_corners_in_the_published_order(objs):
    box = objs["cornell_box"]
    mm = millimetres(box.vertices)
    for material, faces in PUBLISHED.items():
        stored = [mm[p] for p, m in zip(box.polygons, box.materials, strict=True) if m == material]
        assert len(stored) == len(faces)
        for polygon, text in zip(stored, faces, strict=True):
            np.testing.assert_allclose(polygon, corners(text), atol=2e-4)


def test_cornell_room_is_open_in_front_only(objs):
    box = objs["cornell_box"]
    room = np.concatenate([box.triangles(name) for name in ROOM])
    open_edges = edges_without_twin(room)
    assert len(open_edges) == 4
    np.testing.assert_allclose([box.vertices[list(e), 2] for e in open_edges], 1.15, atol=1e-9)


def test_cornell_only_the_lamp_emits():
    materials = read_mtl(FOLDER / "cornell_box.mtl")
    assert materials["lamp"]["Ke"] == [17, 12, 4]
    assert [name for name, m in materials.items() if "Ke" in m] == ["lamp"]
    assert all(m["Ns"] == [1] for m in materials.values())


# --- Scenes in which light bounces ------------------------------------------------------------------------------------


def test_the_four_lights_have_one_intensity_and_four_sizes(objs):
    plates, materials = objs["veach_plates"], read_mtl(FOLDER / "veach_plates.mtl")
    radii, intensities = [], []
    for i in range(1, 5):
        points = plates.vertices[np.unique(plates.triangles(f"light_{i}"))]
        radii.append(np.ptp(points[:, 1]) / 2)
        luminance = np.dot([0.2126, 0.7152, 0.0722], materials[f"light_{i}"]["Ke"])
        intensities.append(np.pi * radii[-1] ** 2 * luminance)
        assert signed_volume(plates.vertices, plates.triangles(f"light_{i}")) > 0  # they emit outwards
    assert np.all(np.divide(radii[1:], radii[:-1]) > 2.5)
    np.testing.assert_allclose(intensities, intensities[0], rtol=0.1)


# --- glTF files -------------------------------------------------------------------------------------------------------


def read_glb(name):
    """-> the JSON, and the bytes of each buffer view"""
    raw = (FOLDER / f"{name}.glb").read_bytes()
    magic, version, total, length, _ = struct.unpack_from("<4sIIII", raw)
    assert (magic, version, total) == (b"glTF", 2, len(raw))
    content, data = json.loads(raw[20 : 20 + length]), raw[28 + length :]
    (buffer,) = content["buffers"]
    assert buffer["byteLength"] == len(data)
    views = [data[v["byteOffset"] : v["byteOffset"] + v["byteLength"]] for v in content["bufferViews"]]
    return content, views


def glb_shapes(content, views):
    """-> points, normals, triangles, and uv or None, of each mesh, without its node"""

    def array(number):
        entry = content["accessors"][number]
        kind, width = (
            {5126: "<f4", 5123: "<u2"}[entry["componentType"]],
            {"VEC2": 2, "VEC3": 3, "SCALAR": 3}[entry["type"]],
        )
        return np.frombuffer(views[entry["bufferView"]], kind).reshape(-1, width)

    for mesh in content["meshes"]:
        (part,) = mesh["primitives"]
        names = part["attributes"]
        uv = array(names["TEXCOORD_0"]) if "TEXCOORD_0" in names else None
        points, normals, triangles = array(names["POSITION"]), array(names["NORMAL"]), array(part["indices"])
        yield points.astype(np.float64), normals.astype(np.float64), triangles.astype(int), uv


def test_the_spheres_are_a_grid_of_roughness_and_metalness():
    content, views = read_glb("ggx_spheres")
    looks = [material["pbrMetallicRoughness"] for material in content["materials"]]
    assert len({tuple(look["baseColorFactor"]) for look in looks}) == 1
    found = [(look["metallicFactor"], look["roughnessFactor"]) for look in looks]
    assert found == [(metal, rough) for metal in (1, 0.5, 0) for rough in (0.1, 0.2, 0.4, 0.6, 0.8, 1)]
    places = np.array([node["translation"] for node in content["nodes"]])
    assert [mesh["primitives"][0]["material"] for mesh in content["meshes"]] == list(range(18))
    for (metal, rough), (x, y, _) in zip(found, places, strict=True):
        assert y == 0.5 + metal
        assert max([r for (_, r), p in zip(found, places, strict=True) if p[0] > x], default=0) < rough
    points, normals, triangles, _ = next(glb_shapes(content, views))
    assert not edges_without_twin(triangles)
    assert signed_volume(points, triangles) == pytest.approx(4.18879 * 0.22**3, rel=0.03)
    np.testing.assert_allclose(points, 0.22 * normals, atol=1e-6)


def test_the_globe_is_a_sphere_whose_picture_has_land_sea_and_ice():
    """From the west to the east, and from the north at the top, as seen from outside."""
    content, views = read_glb("globe")
    (points, normals, triangles, uv), (_, up, floor, tiles) = glb_shapes(content, views)
    np.testing.assert_allclose(points, 0.9 * normals, atol=1e-6)
    assert signed_volume(points, triangles) == pytest.approx(4.18879 * 0.9**3, rel=0.05)
    assert face_normals(points, triangles).shape == (528, 3)
    np.testing.assert_allclose(np.cos(np.pi * uv[:, 1]), normals[:, 1], atol=1e-6)
    longitude = np.stack([np.cos(2 * np.pi * uv[:, 0]), -np.sin(2 * np.pi * uv[:, 0])], axis=-1)
    np.testing.assert_allclose(normals[:, [0, 2]], longitude * np.sin(np.pi * uv[:, 1:]), atol=1e-6)
    assert (up == [0, 1, 0]).all()
    assert len(floor) == 2
    assert tiles.max() == 8
    colours, layer, checks = (
        np.asarray(Image.open(io.BytesIO(views[image["bufferView"]])).convert("RGB")).astype(int)
        for image in content["images"]
    )
    assert colours.shape == layer.shape == (48, 96, 3)
    assert len(np.unique(checks.reshape(-1, 3), axis=0)) == 2
    is_sea = colours[..., 2] > colours[..., 0] + 60
    assert 0.3 < is_sea.mean() < 0.7
    assert layer[is_sea, 1].max() < 0.45 * 255 < layer[~is_sea, 1].min()
    assert not layer[..., [0, 2]].any()
    for row in (0, -1):
        assert (colours[row] > 200).all()


# --- Environments -----------------------------------------------------------------------------------------------------


def environment(name):
    return np.load(FOLDER / "environments" / f"{name}.npy")


def directions(image):
    """Through the centres of the texels, by inverting A2-5; row 0 is the top."""
    height, width = image.shape[:2]
    azimuth = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    flat = np.cos(elevation)
    d = np.broadcast_arrays(flat * np.cos(azimuth), np.sin(elevation), flat * np.sin(azimuth))
    return np.stack(d, axis=-1)


SIZES = {"studio": (256, 512), "sunny": (384, 768), "white": (2, 4), "black": (2, 4)}


@pytest.mark.parametrize("name", SIZES)
def test_environment_is_half_float_finite_and_not_negative(name):
    image = environment(name)
    assert image.shape == (*SIZES[name], 3)
    assert image.dtype == np.float16
    assert np.isfinite(image).all()
    assert (image >= 0).all()


def test_sun_stands_where_it_should_and_outshines_the_sky_10000_times():
    image = environment("sunny").astype(np.float64)
    luminance = image @ [0.2126, 0.7152, 0.0722]
    d = directions(image)
    assert luminance.max() > 1e4 * np.median(luminance[d[..., 1] > 0])
    sun = d[np.unravel_index(luminance.argmax(), luminance.shape)]
    assert np.degrees(np.arcsin(sun[1])) == pytest.approx(41, abs=1)
    assert sun[0] < 0 < sun[2]


def test_studio_has_three_soft_boxes_of_different_colour_in_a_dark_room():
    image = environment("studio").astype(np.float64)
    d = directions(image)
    assert 25 < image.max() < 32
    assert np.median(image) < 0.1
    boxes = {"key": (-0.75, 0.62, 0.62), "rim": (0.95, 0.18, -0.30), "top": (0.10, 1.00, -0.10)}
    colour = {}
    for name, towards in boxes.items():
        row, column = np.unravel_index(np.argmax(d @ np.array(towards)), d.shape[:2])
        colour[name] = image[row, column]
        assert colour[name].min() > 3
    assert colour["key"][0] > colour["key"][2]
    assert colour["rim"][0] < colour["rim"][2]
    assert np.ptp(colour["top"]) < 0.1 * colour["top"].max()
