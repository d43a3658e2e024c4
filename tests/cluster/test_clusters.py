"""What ``--cluster`` may name; what it may not is told in one line before anything starts."""

import socket
import sys

import pytest

from taichi_tracer.apps.cli import main
from taichi_tracer.cluster import clusters


def said(where, capsys):
    """The line about a cluster that cannot be used."""
    assert main(["render", "cube", "--cluster", where]) == 2
    return capsys.readouterr().err.strip()


@pytest.mark.parametrize("where", ["nowhere", "local:x", "tcp://", "http://host:8786", "slurm:"])
def test_what_names_no_cluster_is_told_with_what_would(where, capsys):
    line = f"taichi-tracer: error: --cluster {where}: give local or local:4, tcp://host:8786"
    assert said(where, capsys).startswith(line)


@pytest.mark.parametrize("where", ["local:0", "local:99999999"])
def test_how_many_workers_there_may_be(where, capsys):
    assert "give at least 1 worker, and at most local:" in said(where, capsys)


def test_without_dask_one_line_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert said("local:2", capsys) == f"taichi-tracer: error: {clusters.INSTALL}"


@pytest.mark.parametrize("where", ["tcp://127.0.0.1:9", "tcp://127.0.0.1:99999", "tls://127.0.0.1:9"])
def test_nobody_answers(where, capsys):
    pytest.importorskip("distributed")
    assert "no scheduler answers there" in said(where, capsys)


def test_who_answers_is_no_scheduler(monkeypatch, capsys):
    pytest.importorskip("distributed")
    monkeypatch.setattr(clusters, "CONNECT", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        assert "no scheduler answers there" in said(f"tcp://127.0.0.1:{server.getsockname()[1]}", capsys)
