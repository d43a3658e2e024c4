"""The command ``render --cluster``, and pictures of a cluster in Python."""

import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
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


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["mine", "submissions"], "to which no assignment of your own is sent"),
        (["rt3", "missing"], "missing: no such file or folder"),
        (["rt3", "folders"], "a cluster grades zip files, and this is a folder"),
        (["rt3", "OUT.zip", "--gradescope-upload"], "--gradescope-upload grades nothing"),
    ],
)
def test_what_a_cluster_cannot_grade_is_told(words, told, tmp_path, capsys):
    pytest.importorskip("distributed")
    (tmp_path / "folders" / "123456789").mkdir(parents=True)
    assert told in told_by(["grade", *words, "--cluster", "local:1"], capsys, code=2)


@pytest.mark.exhaustive
def test_an_adaptive_picture_has_the_bits_of_one_process(capsys):
    pytest.importorskip("distributed")
    told_by([*WORDS, "--adaptive", "--spp", 37, "-o", "alone.npy"], capsys)
    told = told_by([*WORDS, "--adaptive", "--spp", 37, "--cluster", "local:2", "-o", "shared.npy"], capsys)
    assert "40x24, 37 spp on average, error" in told
    np.testing.assert_array_equal(np.load("shared.npy"), np.load("alone.npy"))


@pytest.mark.long
def test_two_local_workers_make_the_picture_of_one_process_and_go_on_from_its_checkpoint(capsys):
    pytest.importorskip("distributed")
    told_by([*WORDS, "--spp", 37, "-o", "alone.npy"], capsys)
    told_by([*WORDS, "--spp", 5, "--checkpoint", "a.checkpoint", "-o", "first.npy"], capsys)
    more = ["--spp", 37, "--checkpoint", "a.checkpoint", "--cluster", "local:2", "-o", "shared.npy"]
    told = told_by([*WORDS, *more], capsys)
    assert "going on after 5 samples" in told
    assert "40x24, 37 spp, error" in told
    np.testing.assert_array_equal(np.load("shared.npy"), np.load("alone.npy"))


@pytest.mark.exhaustive
@pytest.mark.parametrize("sampler", ["niederreiter_two", "independent", "sobol"])
def test_every_sampler_gives_the_same_bits_and_about_the_same_error(sampler):
    pytest.importorskip("distributed")
    options = {"estimator": "mis", "environment": "studio", "intersector": "brute_force", "size": (40, 24)}
    shared = tt.cluster.render("cube", cluster="local:3", spp=37, arch="cpu", sampler=sampler, **options)
    scene = tt.load_scene_data("cube", environment="studio", intersector="brute_force")
    alone = tt.A2Renderer(scene, 40, 24, sampler=sampler).use("mis").render(37)
    np.testing.assert_array_equal(shared.image, alone.image())
    np.testing.assert_allclose(shared.error, alone.error(), rtol=1e-4)


@pytest.mark.exhaustive
def test_time_and_error_end_a_rendering(capsys):
    pytest.importorskip("distributed")
    told = told_by([*WORDS, "--error", 5, "--cluster", "local:2", "-o", "error.png"], capsys)
    assert "note" not in told
    told = told_by([*WORDS, "--time", 2, "--error", "0.001", "--cluster", "local:2", "-o", "time.png"], capsys)
    assert "an error of 0.001 % was not reached: --time 2 came first" in told
    seconds = float(told.split("rendering ")[1].split(" s")[0])
    assert 1 < seconds < 8


@pytest.mark.exhaustive
def test_every_picture_of_a_scene_file_and_its_bounces(capsys):
    pytest.importorskip("distributed")
    words = [
        "render",
        "cornell_box",
        "--estimator",
        "path",
        "--size",
        24,
        "--arch",
        "cpu",
        "--spp",
        4,
        "--bounces",
        "0,1+",
    ]
    told_by([*words, "-o", "alone.npy"], capsys)
    told_by([*words, "-o", "shared.npy", "--cluster", "local:2"], capsys)
    for name in ("bounce_0", "bounce_1+"):
        np.testing.assert_array_equal(np.load(f"shared_{name}.npy"), np.load(f"alone_{name}.npy"))


@pytest.mark.exhaustive
def test_ctrl_c_writes_what_has_come_and_the_same_command_goes_on(tmp_path):
    pytest.importorskip("distributed")
    words = [*WORDS, "--spp", "1000000", "--cluster", "local:2", "--checkpoint", "a.checkpoint", "-o", "part.npy"]
    process = subprocess.Popen(
        [sys.executable, "-m", "taichi_tracer", *words, "--checkpoint-every", "0.5"],
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.path.dirname(os.path.dirname(tt.__file__))},
    )
    try:
        while not (tmp_path / "a.checkpoint").exists():
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130
    assert "interrupted after" in told
    samples = int(told.split("interrupted after ")[1].split(" of")[0])
    start("f32")
    scene = tt.load_scene_data("cube", environment="studio", intersector="brute_force")
    alone = tt.A2Renderer(scene, 40, 24, seed=3).use("mis").render(samples)
    np.testing.assert_array_equal(np.load("part.npy"), alone.image())


@pytest.mark.exhaustive
def test_a_large_scene_of_several_files_travels_once_per_worker(machines, tmp_path):
    """A height field of 200,000 triangles, its MTL and an image: to two workers that have none of them."""
    n = 317
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    z = 0.1 * np.sin(7 * x) * np.cos(5 * y)
    lines = ["mtllib m.mtl", *(f"v {a:.9f} {c:.9f} {b:.9f}" for a, b, c in zip(x.flat, y.flat, z.flat, strict=True))]
    lines.append("usemtl red")
    i = 1 + np.arange(n * n).reshape(n, n)[:-1, :-1].ravel()
    lines += [f"f {a} {a + n} {a + n + 1} {a + 1}" for a in i]
    (tmp_path / "field.obj").write_text("\n".join(lines) + "\n")
    (tmp_path / "m.mtl").write_text("newmtl red\nKd 0.8 0.1 0.1\n")
    np.save(tmp_path / "sky.npy", np.full((4, 8, 3), 0.5, np.float32))
    machines.add(), machines.add()
    options = {"environment": tmp_path / "sky.npy", "estimator": "brdf", "size": (32, 32), "arch": "cpu"}
    with tt.cluster.connect(machines.address) as connection:
        shared = tt.cluster.render(tmp_path / "field.obj", cluster=connection, spp=40, **options)
        sent = connection.bytes_sent
        again = tt.cluster.render(tmp_path / "field.obj", cluster=connection, spp=40, **options)
    size = sum((tmp_path / name).stat().st_size for name in ("field.obj", "m.mtl", "sky.npy"))
    assert sent <= 2 * size
    assert again.statistics.bytes_sent <= 2 * size
    scene = tt.load_scene_data(tmp_path / "field.obj", environment=tmp_path / "sky.npy")
    alone = tt.A2Renderer(scene, 32, 32).use("brdf").render(40)
    np.testing.assert_array_equal(shared.image, alone.image())
    assert not list(tmp_path.glob("w*/**/field.obj"))  # the workers have removed it


@pytest.mark.exhaustive
def test_a_part_of_ones_own_travels_and_that_is_said(machines, tmp_path, capsys):
    from pathlib import Path

    part = Path(__file__).parents[1] / "parts" / "stratified_sampler.py"
    machines.add()
    words = [*WORDS, "--parts", part, "--sampler", "stratified", "--spp", 9]
    told_by([*words, "-o", "alone.npy"], capsys)
    told = told_by([*words, "-o", "shared.npy", "--cluster", machines.address], capsys)
    assert "the files of --parts go to every worker, and run there with its rights" in told
    np.testing.assert_array_equal(np.load("shared.npy"), np.load("alone.npy"))


@pytest.mark.exhaustive
def test_tls_as_the_page_shows_it(tmp_path, monkeypatch, capsys):
    """The commands of docs/cluster.md make certificates; a client without them is refused."""
    import re
    from pathlib import Path

    from machines import Machines

    page = (Path(__file__).parents[2] / "docs" / "cluster.md").read_text(encoding="utf-8")
    for command in re.findall(r"^openssl .*$", page, re.MULTILINE):
        subprocess.run(command, shell=True, check=True, cwd=tmp_path, capture_output=True)
    (settings,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "dask").mkdir()
    settings = re.sub(r"(\w+)\.pem", lambda found: str(tmp_path / found[0]), settings)
    (tmp_path / "dask" / "tls.yaml").write_text(settings)
    monkeypatch.setenv("DASK_CONFIG", str(tmp_path / "dask"))
    machines = Machines(tmp_path, ("--protocol", "tls"))
    try:
        machines.add()
        address = machines.address
        assert address.startswith("tls://")
        command = [sys.executable, "-m", "taichi_tracer", *WORDS, "--spp", "6", "--cluster", address, "-o", "a.npy"]
        environment = os.environ | {"PYTHONPATH": os.path.dirname(os.path.dirname(tt.__file__))}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        del environment["DASK_CONFIG"]
        refused = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
        assert refused.returncode == 2
        assert "has no certificates for tls:" in refused.stderr
    finally:
        machines.end()
    told_by([*WORDS, "--spp", 6, "-o", "alone.npy"], capsys)
    np.testing.assert_array_equal(np.load("a.npy"), np.load("alone.npy"))


@pytest.mark.exhaustive
def test_the_python_of_the_page_runs(capsys):
    import re
    from pathlib import Path

    pytest.importorskip("distributed")
    page = (Path(__file__).parents[2] / "docs" / "cluster.md").read_text(encoding="utf-8")
    names: dict = {}
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    for code in [block for block in blocks if "SLURMCluster" not in block]:
        exec(compile(code, "cluster.md", "exec"), names)
    assert capsys.readouterr().out.startswith("(128, 128, 3) 16 ")
    assert len(names["frames"]) == len(names["study"]) == 4


def test_the_simulation_runs_and_ends_at_a_wall():
    from benchmarks.cluster import MEASURED, simulate

    small, large = simulate(10, MEASURED), simulate(10_000, MEASURED)
    assert small.efficiency > 0.9
    assert large.efficiency < small.efficiency
    assert json.dumps(vars(small))
