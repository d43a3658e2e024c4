"""What was computed is kept somewhere when its disk is full, and the user is told where."""

import errno
import tempfile
from pathlib import Path

import numpy as np
import pytest

from taichi_tracer.apps import rescue
from taichi_tracer.apps.cli import main
from taichi_tracer.files import disk, images
from taichi_tracer.files.images import read_image
from taichi_tracer.renderer import A1Renderer
from taichi_tracer.system.errors import InputError

WORDS = ["render", "cube", "--intersector", "brute_force", "--triangle-test", "moller_trumbore", "--size", "8x8"]


@pytest.fixture
def full(tmp_path, monkeypatch):
    """A folder whose disk is full; temporary files, and those at home, have a disk of their own."""
    folders = {name: tmp_path / name for name in ("full", "temporary", "home")}
    for folder in folders.values():
        folder.mkdir()
    make = tempfile.mkstemp

    def mkstemp(dir=None, **options):
        if Path(dir) == folders["full"]:
            raise OSError(errno.ENOSPC, "No space left on device")
        return make(dir=dir, **options)

    monkeypatch.setattr(disk.tempfile, "mkstemp", mkstemp)
    monkeypatch.setattr(disk.tempfile, "gettempdir", lambda: str(folders["temporary"]))
    monkeypatch.setattr(rescue.Path, "home", lambda: folders["home"])
    return folders["full"]


@pytest.fixture
def instant(monkeypatch):
    monkeypatch.setattr(A1Renderer, "add_sample", lambda self, index: self.film.canvas.fill(0.5))


def test_pictures_of_a_full_disk_are_kept_among_temporary_files(full, instant, capsys):
    assert main([*WORDS, "--view", "hit,normal", "-o", str(full)]) == 2
    told = capsys.readouterr()
    kept = sorted((full.parent / "temporary").glob("taichi_tracer_*/*"))
    assert sorted(path.name for path in kept) == ["cube_hit.png", "cube_normal.png"]
    for path in kept:
        assert read_image(path).shape == (8, 8, 3)
        assert f"{path}: 8x8, 1 spp" in told.out
        missing = f"{full / path.name}: cannot be written (No space left on device)"
        assert f"taichi-tracer: error: {missing}: it is in {path} instead" in told.err
    assert list(full.iterdir()) == []


def test_a_picture_is_kept_as_plain_numbers_at_home_where_nothing_else_can_be_written(full, monkeypatch, capsys):
    monkeypatch.setattr(disk.tempfile, "gettempdir", lambda: str(full / "gone"))
    monkeypatch.setattr(images, "ENCODERS", images.ENCODERS | {".png": fails})
    image = np.arange(12, dtype=np.float32).reshape(2, 2, 3)
    place = rescue.written_picture(full / "x.png", image, srgb=True)
    assert (place.parent.parent, place.name) == (full.parent / "home", "x.pfm")
    np.testing.assert_array_equal(read_image(place), image)
    assert [path.name for path in (full.parent / "home").iterdir()] == [place.parent.name]


def fails(image, srgb, display):
    raise InputError("no such luck")


def test_the_first_error_is_told_where_no_place_can_be_written(full, monkeypatch):
    monkeypatch.setattr(rescue, "other_folders", lambda: iter([full]))
    with pytest.raises(InputError, match="a.txt: cannot be written .No space left"):
        rescue.written_bytes(full / "a.txt", b"")


def test_a_checkpoint_that_cannot_be_written_ends_no_rendering(full, monkeypatch, capsys):
    words = ["--jitter", "--spp", "5", "--checkpoint", str(full / "a.k"), "--checkpoint-every", "1e-9"]
    assert main([*WORDS, *words, "-o", str(full.parent / "x.png")]) == 2
    told = capsys.readouterr()
    assert "5 spp" in told.out
    assert told.err.count("No space left on device): rendering goes on") == 1
    (kept,) = (full.parent / "temporary").glob("taichi_tracer_*/a.k")
    assert f"it is in {kept} instead" in told.err
