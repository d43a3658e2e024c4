"""A process of its own: it answers, tells errors in the words of the package, and leaves the caller's Taichi alone."""

import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.studies import variants
from taichi_tracer.studies.crew import Here
from taichi_tracer.studies.variants import Source, Variant
from taichi_tracer.system.processes import Worker


def test_a_worker_answers_and_ends():
    worker = Worker(is_heard=False)
    try:
        worker.ask("open", Source("kube")).result(60)
        with pytest.raises(tt.InputError, match="unknown scene 'kube'"):
            worker.ask("facts", Variant()).result(60)
        with pytest.raises(RuntimeError, match="has no attribute 'fly'"):
            worker.ask("fly").result(60)
    finally:
        worker.close()
    worker.process.wait(60)
    assert worker.process.returncode == 0


def test_a_worker_that_dies_is_told():
    worker = Worker(is_heard=False)
    worker.process.kill()
    with pytest.raises(RuntimeError, match="a process of the study ended in open"):
        worker.ask("open", Source("cube")).result(60)
    worker.close()


def test_here_is_the_same_without_a_process():
    here = Here()
    here.ask("open", Source("kube")).result()
    with pytest.raises(tt.InputError, match="unknown scene 'kube'"):
        here.ask("facts", Variant()).result()


def test_what_only_the_caller_has_stays_with_the_caller():
    assert not variants.lives_here_alone()

    @tt.register
    class Still(tt.Sampler):
        """All samples are alike."""

        name = "still_here"

        def pair(self, state, i):  # pragma: no cover (never sampled)
            return 0.5, 0.5

    part = (
        tt.PARTS.find("sampler", "still_here") if hasattr(tt, "PARTS") else variants.PARTS.find("sampler", "still_here")
    )
    try:
        assert variants.lives_here_alone()
        assert not variants.lives_here_alone([__file__])
    finally:
        variants.PARTS.remove(part)
    assert not variants.lives_here_alone()


@pytest.mark.exhaustive
def test_a_study_of_a_name_leaves_the_scenes_of_the_caller_alone():
    start("f32")
    scene = tt.load_scene_data("cube", environment="studio", intersector="brute_force")
    renderer = tt.A2Renderer(scene, 16, 16).use("mis").render(2)
    knobs = {"estimators": ("mis",), "samplers": ("niederreiter",), "precisions": ("f64",), "fast_math": (False,)}
    knobs |= {"triangle_tests": ("watertight",), "lookups": ("nearest",), "adaptive": (False,), "scales": (1.0,)}
    table, figure = tt.studies.accuracy("cube", size=(16, 16), budget=40, seeds=1, forms=("fast",), **knobs)
    assert list(table["variant"]) == ["mis, sobol, f64"]
    assert table["last error"][0] > 0
    assert len(figure.axes) == 2
    assert renderer.render(2).samples == 4
