"""What was computed is kept somewhere when its disk is full, and the user is told where."""

import errno
import os
import tempfile
from pathlib import Path

import pytest

from taichi_tracer.apps.cli import main

WORDS = ["render", "cube", "--intersector", "brute_force", "--triangle-test", "moller_trumbore", "--size", "8x8"]


@pytest.fixture
def full(tmp_path, monkeypatch):
    """A folder whose disk is full; temporary files have a disk of their own."""
    folders = {name: tmp_path / name for name in ("full", "temporary")}
    for folder in folders.values():
        folder.mkdir()
    move = os.replace

    def replace(part, path):
        if Path(path).parent == folders["full"]:
            raise OSError(errno.ENOSPC, "No space left on device")
        move(part, path)

    monkeypatch.setattr(os, "replace", replace)
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(folders["temporary"]))
    return folders["full"]


def test_a_checkpoint_that_cannot_be_written_ends_no_rendering(full, monkeypatch, capsys):
    words = ["--jitter", "--spp", "5", "--checkpoint", str(full / "a.k"), "--checkpoint-every", "1e-9"]
    assert main([*WORDS, *words, "-o", str(full.parent / "x.png")]) == 2
    told = capsys.readouterr()
    assert "5 spp" in told.out
    assert told.err.count("No space left on device): rendering goes on") == 1
    (kept,) = (full.parent / "temporary").glob("taichi_tracer_*/a.k")
    assert f"it is in {kept} instead" in told.err
