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

PACKAGE = Path(tt.__file__).parents[1]  # this copy, for processes that start elsewhere
QUICK = ["--intersector", "brute_force", "--triangle-test", "moller_trumbore"]  # what compiles soonest


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


# ── bad input: one line that names what is wrong, and exit code 2 ──


def assert_one_line(error, words):
    lines = [line for line in error.splitlines() if line.startswith("taichi-tracer: error: ")]
    assert len(lines) == 1, error
    assert "Traceback" not in error
    for word in words:
        assert word in lines[0]


@pytest.mark.parametrize("output", ["no/such/x.png", "x.docx", "taken/x/"])
def test_an_unwritable_output_is_noticed_before_the_scene_is_read(output, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken").write_text("a file where a folder should be")
    monkeypatch.setattr(Request, "load", lambda self: pytest.fail("the scene was read first"))
    assert quickly(["render", "cube", "-o", output]) == 2
    assert_one_line(capsys.readouterr().err, [output.rstrip("/")])


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
