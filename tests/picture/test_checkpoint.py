"""The samples of a picture in a file: taken up to the last bit, and refused where they are of something else."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import start

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.picture.adaptive import begin_with, shares_of
from taichi_tracer.picture.checkpoint import facts_of


def load(name, environment="studio", **options):
    """A scene that compiles soon."""
    return tt.load_scene_data(name, environment=environment, intersector="brute_force", **options)


@pytest.fixture(scope="module")
def scene():
    start("f32")
    return load("cube")


def renderer(scene, **options):
    return tt.A2Renderer(scene, 12, 10, **options).use("brdf")


def test_views_have_nothing_to_keep(scene, tmp_path):
    with pytest.raises(tt.InputError, match="every sample of hit is the picture itself"):
        tt.A1Renderer(scene, 8, 8).use("hit").render().save_checkpoint(tmp_path / "a.checkpoint")


@pytest.mark.parametrize("adaptive", [True, None])
def test_a_picture_whose_pixels_have_shares_goes_on_with_them(scene, tmp_path, capsys, adaptive):
    """No pilot is taken again; what other files hold is not added to it."""
    path = tmp_path / "a.checkpoint"
    whole, first, second = (renderer(scene, adaptive=adaptive) for _ in range(3))
    for one in (whole, first):
        one.render(1)
        if adaptive is None:
            begin_with(one, shares_of(np.linspace(0.1, 1, one.height)[:, None] * np.ones(one.width)))
    whole.render(12)
    first.render(5).save_checkpoint(path)
    second.load_checkpoint(path)
    assert second.samples == first.samples
    second.shares.set(second.shares.to_image())
    while second.film.samples < whole.film.samples:
        second.add_sample(second.film.samples)
        second.film.samples += 1
    assert len(np.unique(second.film.counts())) > 1
    np.testing.assert_array_equal(second.image(), whole.image())
    assert main(["merge", str(path), str(path), "--output", str(path.with_name("sum.checkpoint"))]) == 2
    assert "its pixels have different numbers of samples" in capsys.readouterr().err


def test_parts_of_ones_own_are_facts(scene):
    """A picture depends on them: their samples do not belong with those of the package's own."""

    @ti.data_oriented
    class Velvet(Diffuse):
        name = "velvet"

        @ti.func
        def eval(self, material, w_o, w_i, n):
            return material.Kd * tm.dot(n, w_i)

    usual, own = facts_of(renderer(scene)), facts_of(renderer(load("cube", brdfs=[Velvet()])))
    assert usual["own parts"] == []
    assert own["own parts"][0].endswith("Velvet")
    assert {key for key in own if own[key] != usual.get(key)} == {"own parts"}
