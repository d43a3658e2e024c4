"""The command ``render --cluster``, and pictures of a cluster in Python."""

import sys

import pytest
from support import start

from taichi_tracer.apps.cli import main
from taichi_tracer.cluster import members

WORDS = ["render", "cube", "--estimator", "mis", "--environment", "studio", "--intersector", "brute_force"]
WORDS += ["--size", "40x24", "--arch", "cpu", "--seed", "3"]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    start("f32")
    monkeypatch.chdir(tmp_path)


def told_by(words, capsys, code=0):
    assert main([str(word) for word in words]) == code
    captured = capsys.readouterr()
    return captured.out + captured.err


@pytest.mark.parametrize("where", ["local:2", "tcp://127.0.0.1:1"])
def test_without_dask_one_line_says_what_to_install(where, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "distributed", None)
    told = told_by([*WORDS, "--cluster", where], capsys, code=2)
    assert told.strip() == f"taichi-tracer: error: {members.INSTALL}"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--cluster", "nowhere"], "--cluster nowhere: give tcp://host:8786"),
        (["--cluster", "local:0"], "give at least one worker, such as local:2"),
        (["--cluster", "local:x"], "--cluster local:x: give tcp://host:8786"),
        (["--cluster", "tcp://"], "--cluster tcp://: give tcp://host:8786"),
        (["--cluster", "http://host:8786"], "--cluster http://host:8786: give tcp://host:8786"),
        (["--cluster", "tcp://host:99999"], "--cluster tcp://host:99999: give tcp://host:8786"),
        (["--cluster", "local:99999999"], "so many processes do not fit on this machine: give at most local:"),
    ],
)
def test_what_cannot_be_is_told_before_anything_starts(words, told, capsys):
    pytest.importorskip("distributed")
    assert told in told_by([*WORDS, *words], capsys, code=2)
