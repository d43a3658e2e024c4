"""Pictures of real clusters: the samples are those of one process, whatever happens to the workers."""

import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.cluster import sharing
from taichi_tracer.picture.checkpoint import read_checkpoint

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.slow
WORDS = ["render", "cube", "--estimator", "mis", "--environment", "studio", "--size", "48", "--arch", "cpu"]
OPTIONS = {"estimator": "mis", "environment": "studio", "size": (48, 48), "arch": "cpu"}
SPP = 1000


@pytest.fixture(autouse=True)
def _short(monkeypatch, tmp_path):
    """Short ranges, so that a small picture has many."""
    start("f32")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sharing, "SECONDS", 0.05)
    monkeypatch.setattr(sharing, "SECONDS_PER_WORKER", 0.0)


def alone(spp):
    """The picture as one process makes it."""
    return tt.A2Renderer(tt.load_scene_data("cube", environment="studio"), 48, 48).use("mis").render(spp).image()


def assert_is_whole(cluster, watch):
    """The picture of a cluster is that of one process."""
    result = tt.cluster.render("cube", cluster=cluster, spp=SPP, watch=watch, **OPTIONS)
    np.testing.assert_allclose(result.image, alone(SPP), rtol=1e-6)
    assert result.samples == SPP
    assert watch.is_done


class Once:
    """Does something once, when the picture has some samples."""

    def __init__(self, action):
        self.action, self.is_done = action, False

    def __call__(self, progress):
        if progress.samples >= 16 and not self.is_done:
            self.is_done = True
            self.action()


class Machines:
    """A scheduler, and workers in processes of their own; everything ends with the test."""

    def __init__(self):
        self.scheduler = distributed.LocalCluster(n_workers=0, dashboard_address=None)
        self.address, self.processes = self.scheduler.scheduler_address, []

    def add(self, packages=Path(tt.__file__).parent.parent):
        """One more worker, which finds the package in a folder."""
        command = [sys.executable, "-m", "distributed.cli.dask_worker", self.address, "--nthreads", "1", "--no-nanny"]
        environment = os.environ | {"PYTHONPATH": str(packages)}
        self.processes.append(subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL))
        return self.processes[-1]


@pytest.fixture
def machines():
    made = Machines()
    yield made
    for process in made.processes:
        process.kill()
    made.scheduler.close()


def test_a_local_worker_is_killed_in_the_middle_and_starts_again():
    with tt.cluster.connect("local:2") as cluster:
        pids = list(cluster.client.run(os.getpid).values())
        watch = Once(lambda: os.kill(pids[0], signal.SIGKILL))
        assert_is_whole(cluster, watch)
        cluster.client.wait_for_workers(2, timeout=60)


def test_one_worker_goes_and_another_comes_late(machines):
    first = machines.add()
    late = Once(lambda: (machines.add(), first.kill()))
    assert_is_whole(machines.address, late)


def test_another_version_is_one_line(machines, tmp_path, capsys):
    package = Path(tt.__file__).parent
    shutil.copytree(package, tmp_path / "other/taichi_tracer", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "other/taichi_tracer/__init__.py").open("a").write('\n__version__ = "0.0.9"\n')
    machines.add(packages=tmp_path / "other")
    assert main([*WORDS, "--spp", "4", "--cluster", machines.address]) == 2
    last = capsys.readouterr().err.strip().splitlines()[-1]
    assert re.search(rf"worker tcp://\S+: taichi_tracer 0\.0\.9 .* there, {re.escape(tt.__version__)} .* here", last)


def test_time_ends_and_a_checkpoint_goes_on_without_a_cluster():
    words = [*WORDS, "--checkpoint", "c.checkpoint", "-o", "cube.npy"]
    assert main([*words, "--time", "2", "--cluster", "local:2"]) == 0
    facts, _ = read_checkpoint("c.checkpoint")
    spp = facts["samples"][0][1] + 5
    assert main([*words, "--spp", str(spp)]) == 0
    np.testing.assert_allclose(np.load("cube.npy"), alone(spp), rtol=1e-6)


def after_some_samples(monkeypatch, action):
    """Do something once, when a picture of the command line has some samples."""
    add, once = sharing.DistributedRender.add, Once(action)

    def add_and_act(self):
        add(self)
        once(self.progress)

    monkeypatch.setattr(sharing.DistributedRender, "add", add_and_act)


def test_ctrl_c_keeps_the_picture_so_far(monkeypatch, capsys):
    after_some_samples(monkeypatch, lambda: os.kill(os.getpid(), signal.SIGINT))
    assert main([*WORDS, "--spp", str(100 * SPP), "-o", "cube.npy", "--cluster", "local:2"]) == 130
    samples = int(capsys.readouterr().err.split("interrupted after ")[1].split()[0])
    np.testing.assert_allclose(np.load("cube.npy"), alone(samples), rtol=1e-6)


def test_a_lost_scheduler_leaves_a_checkpoint_to_go_on_from(machines, monkeypatch, capsys):
    machines.add()
    after_some_samples(monkeypatch, machines.scheduler.close)
    assert main([*WORDS, "--spp", str(SPP), "-o", "cube.npy", "--cluster", machines.address]) == 2
    assert "is gone after" in capsys.readouterr().err
    assert main([*WORDS, "--spp", str(SPP), "-o", "cube.npy", "--checkpoint", "cube.checkpoint"]) == 0
    np.testing.assert_allclose(np.load("cube.npy"), alone(SPP), rtol=1e-6)
