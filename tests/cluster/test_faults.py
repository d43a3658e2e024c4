"""What goes wrong in a cluster, with real processes: the picture keeps its bits, or a clear error loses nothing."""

import re
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.cluster import members, ranges, sharing
from taichi_tracer.system.errors import IncompleteError

pytestmark = pytest.mark.slow
OPTIONS = {"estimator": "mis", "environment": "studio", "intersector": "brute_force", "size": (48, 48), "arch": "cpu"}
SPP = 3000


@pytest.fixture(scope="module")
def alone():
    """The picture as one process makes it."""
    start("f32")
    scene = tt.load_scene_data("cube", environment="studio", intersector="brute_force")
    return tt.A2Renderer(scene, 48, 48).use("mis").render(SPP).image()


@pytest.fixture(autouse=True)
def _short(monkeypatch):
    """Short ranges, so that a small picture has many."""
    start("f32")
    monkeypatch.setattr(ranges, "SECONDS", 0.05)
    monkeypatch.setattr(sharing, "COLLECT_EVERY", 0.1)


class Watch:
    """Does something once, when so many ranges are done."""

    def __init__(self, statistics_of, after: int, action) -> None:
        self.statistics_of, self.after, self.action, self.is_done = statistics_of, after, action, False

    def __call__(self, progress) -> None:
        if not self.is_done and self.statistics_of().ranges >= self.after:
            self.is_done = True
            self.action()


@pytest.fixture
def statistics(monkeypatch):
    """The statistics of the picture that is being rendered."""
    made = []
    begin = sharing.Sharing.__init__

    def noting(self, *words, **options):
        begin(self, *words, **options)
        made.append(self.statistics)

    monkeypatch.setattr(sharing.Sharing, "__init__", noting)
    return lambda: made[-1]


def rendered(machines, lines=None, **more):
    told = [] if lines is None else lines
    with tt.cluster.connect(machines.address, told.append) as connection:
        return tt.cluster.render("cube", cluster=connection, **{"spp": SPP, **OPTIONS, **more})


def test_a_worker_is_killed_in_the_middle(machines, alone, statistics):
    for _ in range(3):
        machines.add()
    lines = []
    watch = Watch(statistics, 5, lambda: machines.workers[1].send_signal(signal.SIGKILL))
    result = rendered(machines, lines, watch=watch)
    assert watch.is_done
    np.testing.assert_array_equal(result.image, alone)
    assert result.samples == SPP
    assert any("has gone" in line for line in lines)


def test_a_worker_with_another_version_is_refused_by_name_and_the_others_go_on(machines, alone, tmp_path):
    """Its copy of the package has one more line."""
    import shutil

    other = tmp_path / "other"
    package = Path(tt.__file__).parent
    shutil.copytree(package, other / "taichi_tracer", ignore=shutil.ignore_patterns("__pycache__"))
    (other / "scene_data_dir").symlink_to(package.parent / "scene_data_dir")
    (other / "taichi_tracer" / "__init__.py").open("a").write('\n__version__ = "0.0.9"\n')
    machines.add(FIRST=str(other))
    lines = []
    here = re.escape(tt.__version__)
    with pytest.raises(IncompleteError, match=rf"no worker of .* taichi_tracer 0\.0\.9 .* there, {here} .* here"):
        rendered(machines, lines)
    machines.add()
    time.sleep(3)
    result = rendered(machines, lines)
    assert any("is left out: taichi_tracer 0.0.9" in line for line in lines)
    np.testing.assert_array_equal(result.image, alone)


def test_a_lost_scheduler_leaves_a_checkpoint_to_go_on_from(machines, alone, statistics, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    machines.add(), machines.add()

    def kill():
        machines.scheduler.send_signal(signal.SIGKILL)

    begin = sharing.Sharing.put
    counted = []

    def put(self, *words):
        begin(self, *words)
        counted.append(self.renderer.samples)
        if len(counted) == 1:
            kill()

    monkeypatch.setattr(sharing.Sharing, "put", put)
    words = ["render", "cube", "--estimator", "mis", "--environment", "studio", "--intersector", "brute_force"]
    words += ["--size", "48", "--arch", "cpu", "--spp", str(SPP), "-o", "cube.npy"]
    assert main([*words, "--cluster", machines.address]) == 2
    told = capsys.readouterr().err
    assert "is gone after" in told
    assert "with --checkpoint cube.checkpoint" in told
    assert (tmp_path / "cube.npy").exists()
    assert main([*words, "--checkpoint", "cube.checkpoint"]) == 0
    np.testing.assert_array_equal(np.load("cube.npy"), alone)


def test_nobody_answers(capsys):
    members.CONNECT, former = 1.0, members.CONNECT
    try:
        assert main(["render", "cube", "--cluster", "tcp://127.0.0.1:9", "-o", "never.png"]) == 2
    finally:
        members.CONNECT = former
    assert "no scheduler answers there" in capsys.readouterr().err
