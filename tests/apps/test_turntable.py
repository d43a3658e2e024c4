"""``turntable``: every frame is the picture of ``render`` from its point, and a film has all of them."""

import numpy as np
import pytest
from PIL import Image

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.apps.commands import turntable
from taichi_tracer.camera_controller import Pose

pytestmark = pytest.mark.usefixtures("f32")
WORDS = ["turntable", "cube", "--size", "20x14", "--eye", "3", "1", "0", "--at", "0", "0.5", "0", "--up", "0", "1", "0"]


def test_every_frame_has_the_bits_of_the_picture_from_its_point(tmp_path, capsys):
    light = ["--estimator", "mis", "--environment", "studio", "--spp", "4"]
    assert main([*WORDS, *light, "--frames", "12", "--degrees", "90", "-o", str(tmp_path / "all")]) == 0
    told = capsys.readouterr().out
    assert "frame 12 of 12: 20x14, 4 spp, error " in told
    assert sorted(path.name for path in (tmp_path / "all").iterdir()) == [f"frame_{k:02d}.png" for k in range(12)]
    scene = tt.load_scene_data("cube", environment="studio")
    eyes = turntable.eyes_of(Pose(np.array([3.0, 1, 0]), np.array([0, 0.5, 0]), np.array([0.0, 1, 0])), 12, 90)
    for k in (0, 7):
        camera = tt.Camera(20, 14, eye=tuple(eyes[k]), at=(0, 0.5, 0), up=(0, 1, 0), fov=scene.view_for(20 / 14)["fov"])
        tt.A3Renderer(scene, camera=camera).use("mis").render(4).save(tmp_path / "one.png")
        one, frame = (np.asarray(Image.open(p)) for p in (tmp_path / "one.png", tmp_path / f"all/frame_{k:02d}.png"))
        np.testing.assert_array_equal(one, frame)
