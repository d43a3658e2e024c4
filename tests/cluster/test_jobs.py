"""Many pictures, each done by one worker; and a class that is graded."""

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.cluster.jobs import in_order


def test_a_turntable_goes_round_its_point():
    views = tt.cluster.turntable(4, at=(1, 2, 3), distance=5, height=0.5)
    np.testing.assert_allclose([v["eye"] for v in views], [[1, 2.5, 8], [6, 2.5, 3], [1, 2.5, -2], [-4, 2.5, 3]])
    views = tt.cluster.turntable(2, at=(0, 0, 0), distance=1, height=2, up_axis="z")
    np.testing.assert_allclose([v["eye"] for v in views], [[0, -1, 2], [0, 1, 2]], atol=1e-12)


def test_variants_are_every_combination():
    found = tt.cluster.variants(estimator=["brdf", "mis"], seed=range(2))
    assert found == [{"estimator": e, "seed": s} for e in ("brdf", "mis") for s in (0, 1)]


def test_no_jobs_are_an_error():
    with pytest.raises(tt.InputError, match="give at least one job"):
        in_order([])


@pytest.mark.exhaustive
def test_the_pictures_of_a_sweep_have_the_bits_of_single_ones():
    pytest.importorskip("distributed")
    start("f32")
    views = tt.cluster.turntable(3, at=(0, 0, 0), distance=4.0, height=1.0)
    common = {
        "environment": "studio",
        "estimator": "mis",
        "intersector": "brute_force",
        "arch": "cpu",
        "size": (24, 24),
    }
    seen = []
    pictures = [*({"scene": "cube", **view} for view in views), {"scene": "cornell_box", "max_bounces": 2}]
    found = tt.cluster.sweep(pictures, cluster="local:2", spp=6, watch=lambda i, _: seen.append(i), **common)
    assert sorted(seen) == [0, 1, 2, 3]
    for one, result in zip(views, found[:3], strict=True):
        scene = tt.load_scene_data("cube", environment="studio", intersector="brute_force")
        camera = tt.Camera(24, 24, eye=one["eye"], at=one["at"], **{k: scene.view_for(1.0)[k] for k in ("up", "fov")})
        alone = tt.A2Renderer(scene, camera=camera).use("mis").render(6)
        np.testing.assert_array_equal(result.image, alone.image())
        assert result.samples == 6
        assert float(result.error) == float(alone.error())


@pytest.mark.exhaustive
def test_a_class_is_graded_as_by_the_command(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    import json
    import zipfile
    from pathlib import Path

    from taichi_tracer.teaching import catalogue, submissions
    from taichi_tracer.teaching.grade import GradingSettings, grade_class
    from taichi_tracer.teaching.marks import read_rules
    from taichi_tracer.teaching.sandbox import best_level

    solution = Path(tt.__file__).parent / "teaching" / "assignments" / "rt3" / "solution"
    (tmp_path / "class").mkdir()
    for student in ("123456789", "234567890"):
        with zipfile.ZipFile(tmp_path / "class" / f"{student}.zip", "w") as archive:
            archive.write(solution / "camera.py", "camera.py")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    weights = tmp_path / "weights.json"
    weights.write_text(json.dumps({"points": {"PerspectiveCamera.generate_ray": 40}, "due": "2026-01-01T00:00"}))
    marks = tt.cluster.grade("rt3", tmp_path / "class", cluster="local:2", trust=True, weights=weights)
    assignment = catalogue.load("rt3")
    rules, found = read_rules(weights, assignment), submissions.find(tmp_path / "class", assignment.files)
    alone = grade_class(assignment, found, rules, GradingSettings(best_level(trust=True), anew=True))
    assert [mark.student for mark in marks] == ["123456789", "234567890"]
    assert [mark.score for mark in marks] == [mark.score for mark in alone]
    assert [mark.deductions for mark in marks] == [mark.deductions for mark in alone]
    assert marks[0].points == sum(part.points for part in assignment.parts) + 37
    assert marks[0].score > 0
