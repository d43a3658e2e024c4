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


def test_a_process_that_renders_is_killed(machines, alone, statistics):
    """Its worker lives on, and starts another one."""
    machines.add()

    def kill():
        (pid,) = [int(p.name) for p in Path("/proc").iterdir() if p.name.isdigit() and is_child_of(p, machines)]
        import os

        os.kill(pid, signal.SIGKILL)

    watch = Watch(statistics, 2, kill)
    result = rendered(machines, watch=watch)
    assert watch.is_done
    np.testing.assert_array_equal(result.image, alone)
    assert result.statistics.repeated > 0


def is_child_of(process: Path, machines) -> bool:
    try:
        fields = (process / "stat").read_text().rsplit(")", 1)[1].split()
        return int(fields[1]) == machines.workers[0].pid and b"cluster.child" in (process / "cmdline").read_bytes()
    except OSError:
        return False


class EnoughError(Exception):
    """What was to be seen has happened."""


def test_a_late_worker_takes_its_share(machines, tmp_path):
    """It comes when the first one has done something; the rendering goes on until it has done something, too."""
    machines.add()
    options = {"spp": 10**8, "checkpoint": tmp_path / "a.checkpoint", **OPTIONS}
    with tt.cluster.connect(machines.address, lambda _: None) as connection:

        def watch(_):
            done = [member.done for member in connection.members.values()]
            if len(machines.workers) == 1 and any(done):
                machines.add()
            if len(done) == 2 and min(done) > 0:
                raise EnoughError

        with pytest.raises(EnoughError):
            tt.cluster.render("cube", cluster=connection, watch=watch, **options)
    scene = tt.load_scene_data("cube", environment="studio", intersector="brute_force")
    shared, alone = (tt.A2Renderer(scene, 48, 48).use("mis") for _ in range(2))
    shared.load_checkpoint(tmp_path / "a.checkpoint")
    assert shared.samples > 0
    np.testing.assert_array_equal(shared.image(), alone.render(shared.samples).image())


def test_a_slow_worker_does_not_hold_up_the_picture(machines, alone, statistics, monkeypatch):
    """It is stopped in the middle of a range, which another one takes; when it goes on, its result does not count."""
    monkeypatch.setattr(sharing, "LEAST", 0.3)
    monkeypatch.setattr(sharing, "PATIENCE", 1.0)
    machines.add(), machines.add()
    stopped = []

    def stop():
        import os

        os.killpg(machines.workers[0].pid, signal.SIGSTOP)
        for pid in [int(p.name) for p in Path("/proc").iterdir() if p.name.isdigit() and is_child_of(p, machines)]:
            os.kill(pid, signal.SIGSTOP)
            stopped.append(pid)

    result = rendered(machines, watch=Watch(statistics, 3, stop))
    import os

    for pid in stopped:
        os.kill(pid, signal.SIGKILL)
    assert stopped
    np.testing.assert_array_equal(result.image, alone)
    assert result.statistics.repeated > 0


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


def test_a_worker_whose_disk_is_full_is_left_out_and_the_others_go_on(machines, tmp_path):
    """Its disk has 1 MB, and the scene has 2 MB."""
    import subprocess

    from machines import APART

    if subprocess.run([*APART, "mount -t tmpfs none /mnt"], check=False, capture_output=True).returncode != 0:
        pytest.skip("this system lets no user mount a disk")
    comments = "".join(f"# {i:078}\n" for i in range(25_000))
    (tmp_path / "scene.obj").write_text("v -1 0 -1\nv 1 0 -1\nv 0 1 0\nf 1 2 3\n" + comments)
    machines.add(room="1m"), machines.add()
    lines = []
    options = {"estimator": "mis", "environment": "studio", "size": (24, 24), "arch": "cpu", "spp": 200}
    with tt.cluster.connect(machines.address, lines.append) as connection:
        shared = tt.cluster.render(tmp_path / "scene.obj", cluster=connection, **options)
        while not lines:  # the one with room may have been faster
            shared = tt.cluster.render(tmp_path / "scene.obj", cluster=connection, seed=len(lines), **options)
    (line,) = lines
    assert line.endswith("scene/scene.obj: cannot be written (No space left on device)")
    scene = tt.load_scene_data(tmp_path / "scene.obj", environment="studio")
    np.testing.assert_array_equal(shared.image, tt.A2Renderer(scene, 24, 24).use("mis").render(200).image())


def test_a_folder_that_a_worker_cannot_write_is_told(machines, tmp_path):
    """It goes away after the worker has started."""
    machines.add()
    lines = []
    with tt.cluster.connect(machines.address, lines.append) as connection:
        connection.look()
        while not connection.members:
            time.sleep(0.1)
            connection.looked_at = -1
            connection.look()
        import shutil

        shutil.rmtree(tmp_path / "w0")
        (tmp_path / "w0").write_text("")
        with pytest.raises(IncompleteError, match="no folder for the scene can be made there"):
            tt.cluster.render("cube", cluster=connection, spp=8, **OPTIONS)


def test_nobody_answers(capsys):
    members.CONNECT, former = 1.0, members.CONNECT
    try:
        assert main(["render", "cube", "--cluster", "tcp://127.0.0.1:9", "-o", "never.png"]) == 2
    finally:
        members.CONNECT = former
    assert "no scheduler answers there" in capsys.readouterr().err
