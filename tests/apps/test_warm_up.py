"""What was rendered once is kept: the same picture in a new process compiles nothing."""

import subprocess
import sys
from argparse import Namespace

import pytest

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


@pytest.mark.long
def test_a_second_time_nothing_is_new(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("TI_OFFLINE_CACHE_FILE_PATH", str(tmp_path / "cache"))
    monkeypatch.setattr(
        warm_up, "pictures", lambda _: [("cube", "normal", (16, 16)), ("rt3/two_views", "brdf", (16, 16))]
    )
    for is_first in (True, False):
        assert main(["warm-up", "--jobs", "2"]) == 0
        told = capsys.readouterr().out
        assert "2 of 2 pictures" in told
        assert ("; 0 are new" in told) != is_first


def test_a_picture_that_fails_is_told(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("TI_OFFLINE_CACHE_FILE_PATH", str(tmp_path / "cache"))
    monkeypatch.setattr(warm_up, "pictures", lambda _: [("cube", "unknown", None)])
    assert main(["warm-up"]) == 1
    captured = capsys.readouterr()
    assert "unknown" in captured.err
    assert "0 of 1 pictures" in captured.out


@pytest.mark.long
def test_a_scene_is_warm_afterwards(tmp_path):
    code, told, errors = run(tmp_path, "--for", "cube", "--size", "16x16")
    assert (code, "; 0 are new" in told) == (0, False), errors
    code, told, _ = run(tmp_path, "--for", "cube", "--size", "16x16")
    assert (code, "; 0 are new" in told) == (0, True)
