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


@pytest.fixture(scope="module")
def objs():
    return {name: read_obj(FOLDER / f"{name}.obj") for name in [*OBJ_NAMES, *LIGHT_NAMES]}


# --- The files --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_script_remakes_every_file_to_the_byte():
    command = [sys.executable, "-B", str(FOLDER / "make_scenes.py"), "--check"]
    result = run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr


# --- Meshes -----------------------------------------------------------------------------------------------------------


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
