"""Results say when they were measured and how busy the machine was, and are marked once their code has changed."""

import datetime
import importlib

import pytest

from benchmarks import measure, results

OLD = "2026-11-20; a processor\n\n| a | b |"
NEW = "2026-11-22 12:00 UTC; a processor\n\n| a | b |"


@pytest.fixture
def changed(monkeypatch):
    """All code was changed at noon of a day, but that of the reader of .obj files, of which nothing is known."""
    noon = datetime.datetime(2026, 11, 22, 11, 0, tzinfo=datetime.timezone.utc)
    monkeypatch.setattr(results, "changed_at", lambda path: None if "obj" in path or "text" in path else noon)


def test_results_that_are_older_than_their_code_are_marked_once(changed):
    once = results.marked("build", OLD)
    assert once.startswith(results.MARK)
    assert "taichi_tracer/fast/bvh_build.py" in once
    assert results.marked("build", once) == once
    assert results.marked("build", NEW) == NEW
    assert results.marked("obj_reader", OLD) == OLD


@pytest.mark.parametrize("name", results.BENCHMARKS)
def test_every_benchmark_can_be_imported(name):
    """What a benchmark needs of the others and of the package is there; Mitsuba is imported later, where it is used."""
    assert importlib.import_module(f"benchmarks.{name}").__doc__


def test_messages_of_others_are_left_out_and_what_stands_beside_them_is_kept():
    told = "[Taichi] version 1.7.4\n\x1b[31mWARN  rounding to 4\n\x1b[0m2026-11-22 12:00 UTC; CPU\n| a |\n\x1b[0m"
    assert results.without_messages(told) == "2026-11-22 12:00 UTC; CPU\n| a |"


def test_results_without_a_date_are_doubted(changed):
    assert "it has no date" in results.marked("direct", "| a | b |")


def test_every_benchmark_names_files_that_exist():
    assert results.MEASURED.keys() == results.BENCHMARKS.keys()
    for name, paths in results.MEASURED.items():
        for path in (f"benchmarks/{name}.py", *(f"taichi_tracer/{path}" for path in paths)):
            assert (results.ROOT / path).exists(), path


def test_the_share_of_other_programs_leaves_out_this_process(monkeypatch):
    monkeypatch.setattr(measure.os, "cpu_count", lambda: 4)
    assert measure.share_of_others((0.0, 100.0, 5.0), (10.0, 140.0, 15.0)) == pytest.approx(30 / 40)
    assert measure.share_of_others((0.0, 100.0, 5.0), (10.0, 110.0, 16.0)) == 0.0
