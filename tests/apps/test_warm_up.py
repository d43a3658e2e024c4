"""What was rendered once is kept: the same picture in a new process compiles nothing."""

import subprocess
import sys
from argparse import Namespace

from taichi_tracer.apps import warm_up
from taichi_tracer.apps.cli import main
from taichi_tracer.apps.names import find_views


def run(folder, *words):
    """The output of ``taichi-tracer warm-up`` with a cache of its own."""
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(folder), "TI_OFFLINE_CACHE_FILE_PATH": str(folder / "cache")}
    words = [sys.executable, "-m", "taichi_tracer", "warm-up", *words]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, cwd=folder)
    return done.returncode, done.stdout, done.stderr


def asked(**options):
    return warm_up.pictures(Namespace(**{"scenes": None, "assignments": False, "all": False, "size": None} | options))


def test_every_picture_is_one_that_render_knows():
    for options in ({}, {"all": True}, {"scenes": ["cube"], "size": [(8, 8), (16, 8)]}):
        pictures = asked(**options)
        assert len(set(pictures)) == len(pictures) > 5
        for _, name, _ in pictures:
            assert len(find_views(name)) == 1
    assert {size for _, _, size in pictures} == {(8, 8), (16, 8)}


def test_a_scene_that_is_not_there_is_one_line(capsys, tmp_path):
    assert main(["warm-up", "--for", str(tmp_path / "none.obj")]) == 2
    assert "none.obj: no such file" in capsys.readouterr().err


def test_a_picture_that_fails_is_told(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("TI_OFFLINE_CACHE_FILE_PATH", str(tmp_path / "cache"))
    monkeypatch.setattr(warm_up, "pictures", lambda _: [("cube", "unknown", None)])
    assert main(["warm-up"]) == 1
    captured = capsys.readouterr()
    assert "unknown" in captured.err
    assert "0 of 1 pictures" in captured.out
