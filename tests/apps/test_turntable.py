"""``turntable``: every frame is the picture of ``render`` from its point, and a film has all of them."""

import numpy as np
import pytest
from PIL import Image

import taichi_tracer as tt
from taichi_tracer.apps import turntable
from taichi_tracer.apps.cli import main
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


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["-o", "a.avi"], "-o a.avi: a film is .gif or .mp4, or a folder without an ending takes the frames"),
        (["-o", "nowhere/a.gif"], "nowhere/a.gif: the folder nowhere does not exist"),
        (["--view", "all", "-o", "a.gif"], "turntable: one picture for each frame: name one view"),
        (["--frames", "0", "-o", "a.gif"], "--frames: '0' is not a whole number of at least 1"),
    ],
)
def test_wrong_words_are_one_line_and_nothing_is_written(tmp_path, monkeypatch, capsys, words, told):
    monkeypatch.chdir(tmp_path)
    try:
        code = main([*WORDS, *words])
    except SystemExit as end:
        code = end.code
    assert code == 2
    assert told in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_writes_the_frames_that_are_done(tmp_path, monkeypatch, capsys):
    whole = turntable.frame_of

    def interrupted(renderer, picture, eye, interruption, render):
        image = whole(renderer, picture, eye, interruption, render)
        interrupted.frames += 1
        interruption.number = 2 if interrupted.frames == 3 else None
        return image

    interrupted.frames = 0
    monkeypatch.setattr(turntable, "frame_of", interrupted)
    assert main([*WORDS, "--frames", "5", "-o", str(tmp_path / "a.gif")]) == 130
    assert Image.open(tmp_path / "a.gif").n_frames == 2
    assert "interrupted after 2 of 5 frames" in capsys.readouterr().err
