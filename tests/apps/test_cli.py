"""The command line, called as a function where that is enough and as a process where that is the point."""

import contextlib
import os
import re
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.apps.pictures import Request
from taichi_tracer.renderer import A1Renderer

PACKAGE = Path(tt.__file__).parents[1]  # this copy, for processes that start elsewhere
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
QUICK = ["--intersector", "brute_force", "--triangle-test", "moller_trumbore"]  # what compiles soonest


@pytest.fixture
def instant(monkeypatch):
    """Rendering of a grey picture that compiles next to nothing, where the picture is not the point."""
    monkeypatch.setattr(A1Renderer, "add_sample", lambda self, index: self.film.canvas.fill(0.5))


def run(*words, cwd=None, **variables):
    """The command line in a process of its own, without a terminal; ``variables`` are of its environment."""
    command, env = [sys.executable, *words], environment() | variables
    return subprocess.run(command, env=env, capture_output=True, text=True, timeout=120, cwd=cwd)


def environment():
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(PACKAGE), os.environ.get("PYTHONPATH", "")])}


def quickly(words):
    """``main``, with the options that compile soonest; later words win."""
    return main([words[0], *QUICK, *words[1:]] if words[:1] in (["render"], ["info"]) else words)


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


# ── as a process ──


def test_help_and_version_load_nothing_heavy():
    code = """
import sys
from taichi_tracer.apps.cli import main
for word in ("--version", "--help"):
    try:
        main([word])
    except SystemExit as end:
        assert end.code == 0
loaded = {"taichi", "numpy", "trimesh", "PIL", "tqdm", "matplotlib"} & set(sys.modules)
print("loaded:", sorted(loaded))
"""
    result = run("-c", code)
    assert result.stderr == ""
    assert result.stdout.startswith(f"taichi-tracer {tt.__version__}\nusage: taichi-tracer")
    assert result.stdout.endswith("loaded: []\n")


def test_a_picture_from_a_new_process_without_a_terminal(tmp_path):
    words = ("render", "cube", "--view", "normal", "--size", "64x48", "--spp", "3", "-o", "cube.png")
    result = run("-m", "taichi_tracer", *words, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith("cube.png: 64x48, 3 spp (")
    assert result.stdout.count("\n") == 1
    assert "%|" not in result.stderr  # no progress bar in a pipe
    assert pixels(tmp_path / "cube.png").shape == (48, 64, 3)


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
@pytest.mark.parametrize(
    ("signals", "code", "word"),
    [([signal.SIGINT], 130, b"interrupted")],
)
def test_a_signal_keeps_the_picture_and_says_how_far_it_came(signals, code, word, tmp_path):
    output = tmp_path / "cube.png"
    words = ["-m", "taichi_tracer", "render", "cube", "--spp", "10000000", "-o", str(output)]
    with in_terminal(words, columns=100) as (child, terminal):
        shown = read_until(b"%|", terminal)  # tqdm's bar: the samples have begun
        for number in signals:
            child.send_signal(number)
        shown += read_until(b"of 10000000 samples", terminal)
        told = child.stdout.read()
    assert child.returncode == code
    assert word + b" after" in shown
    assert f"{output}: 512x512, " in told
    assert pixels(output).max() > 0


@contextlib.contextmanager
def in_terminal(words, columns):
    """A process of Python whose errors go to a pseudo-terminal: the process, and the end of the terminal that reads."""
    import fcntl
    import pty
    import struct
    import termios

    terminal, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("4H", 24, columns, 0, 0))
    with subprocess.Popen(
        [sys.executable, *words],
        env=environment(),
        stderr=slave,
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),  # may be ignored, as in CI
    ) as child:
        os.close(slave)
        try:
            yield child, terminal
        except BaseException:
            child.kill()  # nobody reads what it writes: it would wait for ever
            raise
    os.close(terminal)


def read_until(text, terminal, seconds=60):
    """What comes out of a terminal up to ``text``; fails when it does not come in time."""
    shown, deadline = b"", time.monotonic() + seconds
    while text not in shown:
        ready, _, _ = select.select([terminal], [], [], max(0.0, deadline - time.monotonic()))
        assert ready, f"{text} did not appear in {shown}"
        shown += os.read(terminal, 4096)
    return shown


def test_white_of_the_distance_fits_the_scene_and_is_told_or_is_the_one_asked_for(tmp_path, capsys):
    path = tmp_path / "large.obj"
    path.write_text("v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n")
    words = ["render", str(path), "--size", "16", "-o", str(tmp_path / "x.npy")]
    assert quickly([*words, "--view", "distance"]) == 0
    (line,) = (line for line in capsys.readouterr().err.splitlines() if "distance" in line)
    white = float(re.search(r"note: distance: white is (\d+) units", line)[1])
    fitting = np.load(tmp_path / "x.npy")
    assert 0.3 < fitting.max() < 1
    assert quickly([*words, "--view", "distance", "--max-distance", str(2 * white)]) == 0
    np.testing.assert_allclose(np.load(tmp_path / "x.npy"), fitting / 2, rtol=1e-6)
    assert "note: distance" not in capsys.readouterr().err


def test_ctrl_c_keeps_the_samples_done(tmp_path, monkeypatch, instant, capsys):
    render_once = A1Renderer.add_sample

    def interrupted_at_the_third(self, index):
        if self.samples == 2:
            raise KeyboardInterrupt
        render_once(self, index)

    monkeypatch.setattr(A1Renderer, "add_sample", interrupted_at_the_third)
    words = ["render", "cube", "--view", "hit,normal", "--size", "8x8", "--spp", "9", "-o", str(tmp_path)]
    assert quickly(words) == 130
    told = capsys.readouterr()
    assert "2 spp" in told.out
    assert "interrupted after 2 of 9 samples" in told.err
    assert [p.name for p in tmp_path.iterdir()] == ["cube_hit.png"]  # the second view was never begun


# ── bad input: one line that names what is wrong, and exit code 2 ──


BAD_WORDS = {
    "no command": ([], ["COMMAND"]),
    "unknown command": (["rendr", "cube"], ["rendr", "render"]),
    "unknown option": (["render", "cube", "--sice", "8x8"], ["--sice"]),
    "missing file": (["info", "no/such.obj"], ["no/such.obj"]),
    "unknown scene": (["info", "cornel_box"], ["'cornel_box'", "did you mean 'cornell_box'?", "torus_knot"]),
    "unknown scene, none near": (["info", "zzz"], ["'zzz'", "known are", "cube"]),
    "unknown up axis": (["render", "cube", "--up-axis", "x"], ["unknown up axis 'x'", "y, z"]),
    "no distance": (["render", "cube", "--view", "distance", "--max-distance", "0"], ["'0' is not a number more than"]),
    "unknown view": (["render", "cube", "--view", "norml"], ["'norml'", "did you mean 'normal'?", "distance"]),
    "two views": (["render", "cube", "--view", "hit", "--estimator", "mis"], ["--view hit and --estimator mis"]),
    "not an estimator": (["effects", "cube", "--estimator", "hit"], ["unknown estimator 'hit'", "uniform", "mis"]),
    "unknown estimator": (
        ["render", "cube", "--estimator", "zzz"],
        ["view, estimator, path, map or integrator 'zzz'", "mis"],
    ),
    "unknown intersector": (["info", "cube", "--intersector", "octree"], ["'octree'", "bvh", "brute_force"]),
    "unknown triangle test": (["info", "cube", "--triangle-test", "x"], ["'x'", "watertight"]),
    "unknown arch": (["info", "cube", "--arch", "gpu"], ["'gpu'", "cuda"]),
    "unknown precision": (["info", "cube", "--precision", "f16"], ["'f16'", "f64"]),
    "fov 0": (["render", "cube", "--fov", "0"], ["fov", "not 0"]),
    "fov 180": (["render", "cube", "--fov", "180"], ["fov", "not 180"]),
    "fov negative": (["render", "cube", "--fov", "-1e1"], ["fov", "not -10"]),
    "fov no number": (["render", "cube", "--fov", "wide"], ["--fov", "'wide'"]),
    "eye = at": (["render", "cube", "--eye", "1", "2", "3", "--at", "1", "2", "3"], ["eye", "at", "(1, 2, 3)"]),
    "eye is NaN": (["render", "cube", "--eye", "nan", "2", "3"], ["eye", "nan"]),
    "up along the gaze": (["render", "cornell_box", "--up", "0", "0", "-2"], ["up", "(0, 0, -2)", "parallel"]),
    "up nowhere": (["render", "cube", "--up", "0", "0", "0"], ["up (0, 0, 0) has no direction", "(0, 1, 0)"]),
    "two numbers": (["render", "cube", "--eye", "1", "2"], ["--eye", "3"]),
    "handedness": (["render", "cube", "--handedness", "middle"], ["handedness", "'middle'", "right"]),
    "smooth before the scene": (["render", "--smooth", "cube"], ["--smooth", "'cube'", "put it before this option"]),
    "smooth 200": (["render", "cube", "--smooth", "200"], ["--smooth", "'200'", "an angle from 0 to 180 degrees"]),
    "unknown AOV": (["render", "cube", "--aov", "depth"], ["unknown AOV 'depth'", "distance"]),
    "an AOV in a PNG": (["render", "cube", "--aov", "distance,normal", "-o", "x.png"], ["x.png", "Z, N.X", ".exr"]),
    "size 0": (["render", "cube", "--size", "0x8"], ["--size", "'0x8'", "640x480"]),
    "size negative": (["render", "cube", "--size", "-5"], ["--size", "'-5'"]),
    "size no numbers": (["render", "cube", "--size", "8by8"], ["--size", "'8by8'"]),
    "size three numbers": (["render", "cube", "--size", "8x8x8"], ["--size", "'8x8x8'"]),
    "size huge": (["render", "cube", "--size", "99999x99999"], ["--size", "'99999x99999'", "67,108,864"]),
    "spp 0": (["render", "cube", "--spp", "0"], ["--spp", "'0'"]),
    "spp a fraction": (["render", "cube", "--spp", "1.5"], ["--spp", "'1.5'"]),
    "no such folder": (["render", "cube", "-o", "no/such/folder/x.png"], ["no/such/folder"]),
    "unknown format": (["render", "cube", "-o", "x.docx"], ["x.docx", ".png"]),
    "no format": (["render", "cube", "-o", "None"], ["None: the name has no ending", "give None.png"]),
    "no list of bounces": (["render", "cube", "--bounces", "1,2-"], ["--bounces", "'1,2-'", "such as 0,1,2-4,5+"]),
    "bounces backwards": (["render", "cube", "--bounces", "3-1"], ["--bounces", "'3-1'", "such as 0,1,2-4,5+"]),
    "bounces of a view": (["render", "cube", "--bounces", "1"], ["needs paths", "normal", "--estimator path"]),
    "bounces beyond the last": (
        ["render", "cube", "--estimator", "path", "--max-bounces", "3", "--bounces", "4+"],
        ["bounces 4+", "at most 3 bounces"],
    ),
    "bounces twice": (
        ["render", "cube", "--estimator", "path", "--bounces", "1,0-2"],
        ["1 and 0-2 both count the light after 1 bounce:"],
    ),
    "bounces and a time": (
        ["render", "cube", "--estimator", "path", "--bounces", "0,1", "--time", "1"],
        ["--bounces takes the same samples", "--time", "give --spp alone"],
    ),
    "both weights 0": (
        ["render", "cube", "--estimator", "mis_one_sample", "--mis-plight", "0", "--mis-pbrdf", "0", "--quick"],
        ["mis_plight and mis_pbrdf must not both be 0"],
    ),
    "one file, two views": (["render", "cube", "--view", "hit,normal", "-o", "x.png"], ["x.png", "folder"]),
}

BAD_FILES = {
    "empty mesh": ("# nothing\n", ["x.obj", "no triangles"]),
    "index out of range": (TRIANGLE + "f 1 2 9\n", ["x.obj:4", "9"]),
    "no number": ("v 0 zero 0\n", ["x.obj:1", "zero"]),
}


def assert_one_line(error, words):
    lines = [line for line in error.splitlines() if line.startswith("taichi-tracer: error: ")]
    assert len(lines) == 1, error
    assert "Traceback" not in error
    for word in words:
        assert word in lines[0]


@pytest.mark.parametrize("case", BAD_WORDS)
def test_bad_words(case, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words, expected = BAD_WORDS[case]
    assert quickly(words) == 2
    assert_one_line(capsys.readouterr().err, expected)


@pytest.mark.parametrize("case", BAD_FILES)
def test_bad_files(case, tmp_path, capsys):
    text, expected = BAD_FILES[case]
    (tmp_path / "x.obj").write_text(text)
    assert quickly(["render", str(tmp_path / "x.obj"), "-o", str(tmp_path / "x.png")]) == 2
    assert_one_line(capsys.readouterr().err, expected)
    assert not (tmp_path / "x.png").exists()


@pytest.mark.parametrize("output", ["no/such/x.png", "x.docx", "taken/x/"])
def test_an_unwritable_output_is_noticed_before_the_scene_is_read(output, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken").write_text("a file where a folder should be")
    monkeypatch.setattr(Request, "load", lambda self: pytest.fail("the scene was read first"))
    assert quickly(["render", "cube", "-o", output]) == 2
    assert_one_line(capsys.readouterr().err, [output.rstrip("/")])


# ── the grammar ──


# ── info ──


def test_info_tells_what_the_scene_is_made_of(capsys):
    assert main(["info", "cornell_box"]) == 0
    out = capsys.readouterr().out
    scene = tt.load_scene_data("cornell_box")
    facts = dict(line.split(maxsplit=1) for line in out.splitlines()[:3])
    assert facts["triangles"] == str(scene.num_triangles)
    assert facts["dropped"] == "0"
    lamp = next(line for line in out.splitlines() if " lamp " in line)
    assert lamp.split() == ["7", "lamp", "(0.78,", "0.78,", "0.78)", "1", "(17,", "12,", "4)"]
    assert "view eye        (0, 1, 3)" in out


def test_darkness_is_told_and_still_a_picture(tmp_path, capsys):
    words = ["--estimator", "brdf", "--environment", "black", "--size", "8x8", "-o", str(tmp_path / "x.png")]
    assert main(["render", "cube", *words]) == 0
    assert capsys.readouterr().err.count("nothing in this scene emits light") == 1
    assert (tmp_path / "x.png").exists()


# ── targets, checkpoints, and pictures compared ──


def told_by(words, capsys, code=0):
    assert quickly([str(w) for w in words]) == code
    return capsys.readouterr()


def test_one_checkpoint_is_of_one_picture(tmp_path, instant, capsys):
    words = ["render", "cube", "--view", "hit,normal", "--size", "8", "--checkpoint", tmp_path / "a", "-o", tmp_path]
    assert "one file for 2 pictures" in told_by(words, capsys, code=2).err


# ── exposure and tone ──
