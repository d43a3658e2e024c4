"""A backend is tried once for each driver, in a process of its own, and taken only if its picture is the CPU's."""

import json

import pytest

from taichi_tracer.system import trial


@pytest.fixture
def pictures(monkeypatch, tmp_path):
    """What the pictures on backends are, and which were made; answers are kept in a folder of the test."""
    found, made = {"cpu": (0.5, "in 1 s"), "vulkan": (0.5001, "in 5 s")}, []
    monkeypatch.setattr(trial, "picture_on", lambda arch: made.append(arch) or found[arch])
    monkeypatch.setattr(trial, "wanted_folder", lambda: tmp_path)
    return found, made


def test_what_goes_wrong_there_is_one_line(monkeypatch):
    monkeypatch.setattr(trial, "PROGRAM", "raise RuntimeError('the driver has gone')")
    assert trial.picture_on("cpu") == (None, "RuntimeError: the driver has gone")
    monkeypatch.setattr(trial, "PROGRAM", "import os; os._exit(9)")
    assert trial.picture_on("cpu") == (None, "exit code 9")
    monkeypatch.setattr(trial, "SECONDS", 0.2)
    monkeypatch.setattr(trial, "PROGRAM", "import time; time.sleep(60)")
    assert trial.picture_on("cpu") == (None, "not ready after 0.2 s")


def test_it_is_tried_once_for_each_driver(pictures):
    found, made = pictures
    assert trial.problem_of("vulkan", "card 1") is None
    assert trial.problem_of("vulkan", "card 1") is None
    assert made == ["cpu", "vulkan"]
    found["vulkan"] = 0.4, "in 5 s"
    assert trial.problem_of("vulkan", "card 1") is None  # kept
    assert trial.problem_of("vulkan", "card 2") == "another picture: in 5 s"
    found["vulkan"] = None, "exit code -11"
    assert trial.problem_of("vulkan", "card 3") == "exit code -11"
    assert trial.problem_of("vulkan", "card 2") == "another picture: in 5 s"


@pytest.mark.parametrize("text", ["", "[1]", "{"])
def test_a_damaged_file_is_written_anew(text, pictures, tmp_path):
    (tmp_path / trial.KEPT).write_text(text)
    assert trial.problem_of("vulkan", "card") is None
    assert len(json.loads((tmp_path / trial.KEPT).read_text())) == 1


def test_without_a_folder_nothing_is_tried(pictures, monkeypatch):
    monkeypatch.setattr(trial, "cache_folder", lambda wanted: (None, "no room"))
    assert "cannot be kept" in trial.problem_of("vulkan", "card")
    assert pictures[1] == []
