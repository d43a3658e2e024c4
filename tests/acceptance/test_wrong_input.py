"""Wrong input of the command line ends with the exit code 2 and one line that names the value."""

import pytest
from acceptance.command import command

SMALL = ["--size", "8x8"]
CUBE = ["render", "cube", *SMALL]
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
FILES = {
    "part.py": "import taichi_tracer as tt\n\n@tt.register\nclass Mine(tt.Viiew):\n    pass\n",
    "index.obj": TRIANGLE + "f 1 2 9\n",
    "empty.xml": "<RT3></RT3>",
    "other.xml": '<RT3><lookat look_from="0 0 -5" look_at="0 0 0"/><camera type="fisheyed"/></RT3>',
    "text.png": "no picture",
    "text.checkpoint": "no samples",
}
# The words of the command, and what the line names.
WRONG = [
    (["rendr", "cube"], "'rendr'"),
    ([*CUBE, "--sice", "9"], "--sice"),
    (["info", "cornel_box"], "did you mean 'cornell_box'?"),
    (["info", "no/such.obj"], "no/such.obj"),
    (["info", "index.obj"], "index.obj:4"),
    (["info", "empty.xml"], "empty.xml"),
    (["info", "other.xml"], "fisheyed"),
    (["render", "cube", "--size", "0x8"], "'0x8'"),
    (["render", "cube", "--size", "8by8"], "'8by8'"),
    (["render", "cube", "--size", "99999x99999"], "'99999x99999'"),
    ([*CUBE, "--crop", "0", "1", "1", "0"], "crop"),
    ([*CUBE, "--view", "norml"], "did you mean 'normal'?"),
    ([*CUBE, "--estimator", "brfd"], "did you mean 'brdf'?"),
    ([*CUBE, "--view", "hit", "--estimator", "mis"], "--view hit and --estimator mis"),
    ([*CUBE, "--view", "hit,normal", "-o", "x.png"], "x.png"),
    ([*CUBE, "--view", "distance", "--max-distance", "0"], "'0'"),
    ([*CUBE, "--fov", "180"], "not 180"),
    ([*CUBE, "--fov", "wide"], "'wide'"),
    ([*CUBE, "--eye", "nan", "2", "3"], "nan"),
    ([*CUBE, "--eye", "1", "2"], "--eye"),
    ([*CUBE, "--eye", "1", "2", "3", "--at", "1", "2", "3"], "(1, 2, 3)"),
    (["render", "cornell_box", "--up", "0", "0", "-2"], "(0, 0, -2)"),
    ([*CUBE, "--handedness", "middle"], "'middle'"),
    ([*CUBE, "--camera", "fisheye"], "'fisheye'"),
    ([*CUBE, "--up-axis", "x"], "'x'"),
    ([*CUBE, "--intersector", "octree"], "'octree'"),
    ([*CUBE, "--triangle-test", "guess"], "'guess'"),
    ([*CUBE, "--arch", "gpu"], "'gpu'"),
    ([*CUBE, "--precision", "f16"], "'f16'"),
    ([*CUBE, "--sampler", "halton"], "'halton'"),
    ([*CUBE, "--seed", "-3"], "'-3'"),
    ([*CUBE, "--spp", "0"], "'0'"),
    ([*CUBE, "--error", "-1"], "'-1'"),
    ([*CUBE, "--environment", "studoi"], "did you mean 'studio'?"),
    ([*CUBE, "--estimator", "mis", "--environment", "studio", "--intensity", "-1"], "intensity"),
    ([*CUBE, "--estimator", "path", "--max-bounces", "65"], "65"),
    ([*CUBE, "--estimator", "path", "--bounces", "3-1"], "'3-1'"),
    ([*CUBE, "--estimator", "mis_one_sample", "--mis-plight", "0", "--mis-pbrdf", "0"], "mis_plight"),
    ([*CUBE, "--exposure", "bright"], "'bright'"),
    ([*CUBE, "--estimator", "mis", "--tone", "flimic"], "did you mean 'filmic'?"),
    ([*CUBE, "--estimator", "mis", "--clamp", "2", "--spp", "1"], "two samples"),
    ([*CUBE, "--estimator", "mis", "--clamp", "2", "--sampler", "independent"], "independent"),
    ([*CUBE, "--aov", "depth"], "'depth'"),
    ([*CUBE, "-o", "x.docx"], "x.docx"),
    ([*CUBE, "-o", "no/such/x.png"], "no/such"),
    ([*CUBE, "--estimator", "brdf", "--checkpoint", "text.checkpoint", "--spp", "1"], "text.checkpoint"),
    (["info", "cube", "--parts", "part.py"], "part.py:4"),
    (["compare", "text.png", "text.png"], "text.png"),
    (["explain", "cube", *SMALL, "--pixel", "8", "0"], "8"),
    (["explain", "cube", *SMALL, "--pixel", "1", "1", "--html", "part.py"], "part.py: the name of this file must end"),
    (
        ["explain", "cube", *SMALL, "--pixel", "1", "1", "--json", "index.obj"],
        "index.obj: the name of this file must end",
    ),
    ([*CUBE, "--parts", "no.py"], "no.py: no such file"),
    (["accuracy", "cube", "--budget", "0"], "'0'"),
    (["turntable", "cube", "--frames", "0"], "'0'"),
    (["new-part", "shader", "mine"], "'shader'"),
    (["assignment", "new", "a9", "here"], "a9"),
    (["check", "nowhere"], "nowhere"),
    (["samples", "studio", "--count", "0"], "'0'"),
]


@pytest.mark.parametrize(("words", "named"), WRONG, ids=lambda value: value if isinstance(value, str) else "")
def test_wrong_input_is_one_line_that_names_the_value(words, named, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    code = command(*words)
    (line,) = (line for line in capfd.readouterr().err.splitlines() if "error: " in line)
    assert code == 2
    assert named in line
    assert {file.name for file in tmp_path.iterdir()} == set(FILES)


def test_right_input_ends_with_0(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert command(*CUBE, "--view", "hit", "-o", "x.png") == 0
    assert (tmp_path / "x.png").exists()
    assert command("--help") == 0
    assert "render" in capfd.readouterr().out
