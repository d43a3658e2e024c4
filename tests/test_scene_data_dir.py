"""The shipped scenes are what their README says, and their script remakes them to the byte."""

import sys
from pathlib import Path
from subprocess import run

import numpy as np
import pytest
from oracles.tiny_obj import read_obj

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


def edges_without_twin(triangles):
    """Directed edges whose reverse is not there; each directed edge occurs once."""
    edges = [(a, b) for i in range(3) for a, b in zip(*triangles[:, [i, (i + 1) % 3]].T.tolist(), strict=True)]
    present = set(edges)
    assert len(present) == len(edges)
    return {(a, b) for a, b in edges if (b, a) not in present}


def signed_volume(points, triangles):
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.sum(a * np.cross(b, c)) / 6


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


@pytest.mark.parametrize("name", ["cube", "sphere", "torus_knot", "blob", *SPECULAR])
def test_closed_and_facing_outwards(closed_surfaces, name):
    points, triangles = closed_surfaces[name]
    assert not edges_without_twin(triangles)
    assert signed_volume(points, triangles) > 0


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


# --- Scenes in which light bounces ------------------------------------------------------------------------------------


# --- glTF files -------------------------------------------------------------------------------------------------------


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
