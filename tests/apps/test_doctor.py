"""The doctor: every line says whether it is well, and what would mend it if not."""

import sys

import pytest

from taichi_tracer.apps import display, doctor
from taichi_tracer.apps.cli import main
from taichi_tracer.system import cache


@pytest.fixture(autouse=True)
def pictures(monkeypatch):
    """What is told of pictures on the backends, without making them."""
    monkeypatch.setattr(doctor.runtime, "vulkan_devices", lambda: [doctor.runtime.VulkanDevice("llvmpipe", True)])
    found = {"cpu": (0.5, "in 1 s"), "vulkan": (0.5001, "in 5 s")}
    monkeypatch.setattr(doctor.trial, "picture_on", lambda arch: found[arch])
    return found


def test_a_picture_on_a_backend_is_compared_with_the_cpus(pictures):
    told = [str(line) for line in doctor.picture_lines()]
    assert [line.split()[-1] for line in told] == ["ok", "ok"]
    pictures["vulkan"] = 0.4, "in 5 s"
    told = str(list(doctor.picture_lines())[1])
    assert "another picture: in 5 s" in told
    assert "-> use the CPU" in told
    pictures["vulkan"] = None, "exit code -11"
    assert "exit code -11" in str(list(doctor.picture_lines())[1])


def test_the_doctor_finds_nothing_to_fail_on(capsys):
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    facts = [line for line in lines if not line.lstrip().startswith("->")]
    assert all(line.endswith((" ok", " missing")) for line in facts)
    for name in ("Python", "taichi", "numpy", "trimesh", "backend chosen", "display", "window", "kernel cache"):
        assert any(line.startswith(name) for line in facts)
    for above, below in zip(lines, [*lines[1:], ""], strict=True):
        if above.endswith(" missing"):
            assert below.lstrip().startswith("-> ")


def test_what_is_missing_is_told_with_its_remedy(monkeypatch):
    monkeypatch.setattr(doctor.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)  # importing it fails
    no_window = display.WindowVerdict(False, "no screen", "plug one in")
    monkeypatch.setattr(display, "can_open_window", lambda: no_window)
    told = "\n".join(str(line) for line in doctor.examine())
    assert "taichi_tracer[notebook]" in told
    exr = told[told.index("pictures .exr") :].splitlines()
    assert exr[0].endswith("missing")
    assert "taichi_tracer[exr]" in exr[1]
    assert "-> plug one in" in told


def test_a_package_that_is_not_there():
    line = doctor.package_line("no-such-package")
    assert not line.is_ok
    assert "pip install no-such-package" in str(line)


@pytest.mark.parametrize("is_ok", [True, False])
def test_a_line(is_ok):
    text = str(doctor.Line("name", "found", is_ok, "do this"))
    assert ("do this" in text) is not is_ok
    assert text.splitlines()[0].endswith("ok" if is_ok else "missing")


def test_the_patches_of_taichi_are_told():
    switched = "not in TAICHI_TRACER_PATCHES"
    all_on, some_off = {"advice": "", "powers": ""}, {"advice": switched, "powers": ""}
    assert "2 of 2 in use" in str(doctor.patches_line(all_on))
    off = doctor.patches_line(some_off)
    assert (off.is_ok, off.found) == (True, "1 of 2 in use; TAICHI_TRACER_PATCHES leaves out advice")
    unfit = doctor.patches_line(some_off | {"powers": "Taichi 1.8.0 was not tried"})
    assert not unfit.is_ok
    assert "powers: Taichi 1.8.0 was not tried" in unfit.remedy
    assert "0 of 0 in use" in str(doctor.patches_line({}))  # without the folder


def test_the_cache_is_told_with_its_folder_and_its_size(tmp_path):
    (tmp_path / "cache").mkdir()
    (tmp_path / "cache" / "kernel").write_bytes(bytes(1_500_000))
    (line,) = doctor.cache_lines(tmp_path / "cache")
    assert line.is_ok
    assert line.found == f"{tmp_path / 'cache'}: can be written; 1 files, 1.5 MB; may be deleted"


def test_a_cache_that_cannot_be_written_is_told_with_what_follows(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    wanted = tmp_path / "file" / "cache"  # no folder can be made there
    monkeypatch.setattr(cache.tempfile, "gettempdir", lambda: str(tmp_path))
    used, missing = doctor.cache_lines(wanted)
    assert used.is_ok
    assert f"{tmp_path / 'taichi_tracer_cache'}" in used.found
    assert not missing.is_ok
    assert f"{wanted}, cannot be written" in missing.found
    assert f"make {wanted} writable" in missing.remedy


def test_no_cache_at_all_is_told_with_what_it_costs(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    wanted = tmp_path / "file" / "cache"
    monkeypatch.setattr(cache.tempfile, "gettempdir", lambda: str(tmp_path / "file"))
    (line,) = doctor.cache_lines(wanted)
    assert not line.is_ok
    assert line.found == f"{wanted}: cannot be written; every run compiles all kernels again"
    assert "writable" in str(line).splitlines()[1]


def test_the_walls_of_the_grader_are_told(monkeypatch):
    from taichi_tracer.teaching import sandbox

    monkeypatch.setattr(sandbox, "problem_of", lambda level, **_: None)
    lines = {line.name: line for line in doctor.wall_lines()}
    assert [lines[f"walls {name}"].is_ok for name in ("bwrap", "limits")] == [True, True]
    assert lines["walls of grade"].is_ok
    assert lines["walls of grade"].found.startswith("bwrap")
    monkeypatch.setattr(sandbox, "problem_of", lambda level, **_: None if level.name == "limits" else "no")
    *_, line, not_stopped = doctor.wall_lines()
    assert "changing and deleting files" in not_stopped.found
    assert "--trust" in line.found
    assert not line.is_ok
    assert "teaching_security.md" in str(line)
