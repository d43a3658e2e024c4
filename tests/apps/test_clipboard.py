"""Text for the clipboard: by the first program that is there and works."""

import os
import shutil
import subprocess
import sys

import pytest

from taichi_tracer.apps import clipboard

pytestmark = pytest.mark.skipif(os.name != "posix", reason="the programs of these tests are shell scripts")


@pytest.fixture
def programs(tmp_path, monkeypatch):
    """Makes programs that write their arguments and their input into a file, or fail; nothing else can be found."""
    cat = shutil.which("cat")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)

    def make(name, script=f'echo "$0 $@" > "$0.out"; {cat} >> "$0.out"'):
        path = tmp_path / name
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)
        return path.with_name(f"{name}.out")

    return make


def test_without_a_program_nothing_is_copied(programs):
    assert not clipboard.copy("text")


def test_the_first_program_that_works_gets_the_text(programs):
    programs("xclip", "exit 1")
    out = programs("xsel")
    assert clipboard.copy("--eye 0 1 3 é")
    assert out.read_text(encoding="utf-8").splitlines()[1] == "--eye 0 1 3 é"
    assert "--clipboard --input" in out.read_text(encoding="utf-8")


def test_a_program_that_hangs_is_left(programs, monkeypatch):
    programs("xclip", f"exec {sys.executable} -c 'import time; time.sleep(60)'")
    monkeypatch.setattr(clipboard, "PATIENCE", 0.2)
    assert not clipboard.copy("text")


@pytest.mark.parametrize(
    ("platform", "display", "wayland", "expected"),
    [
        ("darwin", "", "", ["pbcopy"]),
        ("win32", "", "", ["clip"]),
        ("linux", ":0", "", ["xclip", "xsel"]),
        ("linux", ":0", "wayland-0", ["wl-copy", "xclip", "xsel"]),
        ("linux", "", "", []),
    ],
)
def test_every_desktop_has_its_programs(platform, display, wayland, expected, monkeypatch):
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.setenv("WAYLAND_DISPLAY", wayland)
    assert [command[0] for command in clipboard.commands()] == expected


def test_a_program_that_cannot_be_run_is_no_error(programs, monkeypatch):
    programs("xclip")

    def refuse(*_words, **_options):
        raise PermissionError

    monkeypatch.setattr(subprocess, "run", refuse)
    assert not clipboard.copy("text")
