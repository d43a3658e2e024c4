"""The samples of a picture in a file: taken up to the last bit, and refused where they are of something else."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import long_except, start

import taichi_tracer as tt
from taichi_tracer.apps.merge import content_of
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.files.checkpoint import read_checkpoint, write_checkpoint
from taichi_tracer.picture.adaptive import shares_of
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


@pytest.mark.exhaustive
def test_a_continued_picture_is_that_of_one_run(scene, tmp_path):
    whole, first, second = (renderer(scene) for _ in range(3))
    whole.render(13)
    first.render(6)
    first.save_checkpoint(tmp_path / "a.checkpoint")
    second.load_checkpoint(tmp_path / "a.checkpoint")
    assert second.samples == 6
    second.render(7)
    np.testing.assert_array_equal(second.image(), whole.image())
    np.testing.assert_array_equal(second.film.variance_of_mean(), whole.film.variance_of_mean())


@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: r.use("mis"), "another estimator: brdf there, mis here"),
        pytest.param(lambda r: setattr(r, "seed", 4), "another seed: 0 there, 4 here", marks=pytest.mark.long),
        pytest.param(lambda r: r.camera.set_camera_parameters(fov=50), "another camera", marks=pytest.mark.long),
        (lambda r: setattr(r, "first_sample", 3), "holds the samples 0 to 1, not those from 3 on"),
    ],
)
def test_samples_of_something_else_are_refused(scene, tmp_path, change, message):
    path = tmp_path / "a.checkpoint"
    renderer(scene).render(2).save_checkpoint(path)
    before, other = path.read_bytes(), renderer(scene)
    change(other)
    with pytest.raises(tt.InputError, match=message):
        other.load_checkpoint(path)
    assert path.read_bytes() == before


@pytest.mark.long
def test_another_scene_light_or_size_is_refused(scene, tmp_path):
    path = tmp_path / "a.checkpoint"
    renderer(scene).render(2).save_checkpoint(path)
    lit = load("cube", "white")
    for other in (renderer(lit), renderer(load("sphere"))):
        with pytest.raises(tt.InputError, match="another scene"):
            other.load_checkpoint(path)
    with pytest.raises(tt.InputError, match="another (camera|size)"):
        tt.A2Renderer(scene, 10, 12).use("brdf").load_checkpoint(path)


def test_views_have_nothing_to_keep(scene, tmp_path):
    with pytest.raises(tt.InputError, match="every sample of hit is the picture itself"):
        tt.A1Renderer(scene, 8, 8).use("hit").render().save_checkpoint(tmp_path / "a.checkpoint")


@pytest.mark.long
@pytest.mark.parametrize("sampler", long_except(["sobol", "niederreiter", "independent"], "sobol"))
def test_each_sampler_goes_on_where_it_was(scene, tmp_path, sampler):
    """Also from a first sample that is not 0, with a crop, and with the film's own kind of sums."""
    options = {"sampler": sampler, "first_sample": 5, "crop": (2, 9, 1, 8), "seed": 3}
    whole, first, second = (renderer(scene, **options) for _ in range(3))
    whole.render(5)
    first.render(2).save_checkpoint(tmp_path / "a.checkpoint")
    second.load_checkpoint(tmp_path / "a.checkpoint")
    np.testing.assert_array_equal(second.render(3).image(), whole.image())


@pytest.mark.exhaustive
def test_a_checkpoint_of_a_checkpoint_holds_all_samples(scene, tmp_path):
    path = tmp_path / "a.checkpoint"
    whole, part = renderer(scene).render(6), renderer(scene).render(2)
    for _ in range(2):
        part.save_checkpoint(path)
        part = renderer(scene)
        part.load_checkpoint(path)
        part.render(2)
    assert part.samples == 6
    np.testing.assert_array_equal(part.image(), whole.image())


@pytest.mark.long
def test_a_refused_file_changes_nothing(scene, tmp_path):
    path = tmp_path / "a.checkpoint"
    renderer(scene).render(2).save_checkpoint(path)
    other = renderer(scene, seed=9).render(3)
    before = other.image()
    with pytest.raises(tt.InputError, match="another seed"):
        other.load_checkpoint(path)
    assert other.samples == 3
    np.testing.assert_array_equal(other.image(), before)


@pytest.mark.parametrize("adaptive", [True, None])
def test_a_picture_whose_pixels_have_shares_goes_on_with_them(scene, tmp_path, adaptive):
    """No pilot is taken again; what other files hold is not added to it."""
    path = tmp_path / "a.checkpoint"
    whole, first, second = (renderer(scene, adaptive=adaptive) for _ in range(3))
    for one in (whole, first):
        one.render(1)
        if adaptive is None:
            one.own_shares.begin(shares_of(np.linspace(0.1, 1, one.height)[:, None] * np.ones(one.width)))
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
    with pytest.raises(tt.InputError, match="its pixels have different numbers of samples"):
        content_of(path)


# ── what a picture depends on ──


@pytest.mark.long
def test_facts_name_everything_that_the_bits_depend_on(scene):
    usual = facts_of(renderer(scene))
    changed = {
        "estimator": renderer(scene).use("mis"),
        "seed": renderer(scene, seed=1),
        "sampler": renderer(scene, sampler="independent"),
        "jitter": renderer(scene, jitter=False),
        "crop": renderer(scene, crop=(0, 3, 0, 3)),
        "size": tt.A2Renderer(scene, 12, 11, camera=tt.Camera(12, 11, **scene.view)).use("brdf"),
        "triangle test": renderer(load("cube", triangle_test="moller_trumbore")),
        "scene": renderer(load("cube", "white")),
    }
    for name, other in changed.items():
        facts = facts_of(other)
        assert name in {key for key in facts if facts[key] != usual.get(key)}, name
    turned = renderer(scene)
    turned.camera.set_camera_parameters(handedness="right")
    assert facts_of(turned)["camera"] != usual["camera"]
    scene.environment.set_rotation(5)
    assert facts_of(renderer(scene))["scene"] != usual["scene"]
    scene.environment.set_rotation(0)
    assert facts_of(renderer(scene)) == usual


def test_parts_of_ones_own_are_facts(scene):
    """A picture depends on them: their samples do not belong with those of the package's own."""

    @ti.data_oriented
    class Velvet(Diffuse):
        name = "velvet"

        @ti.func
        def eval(self, material, w_o, w_i, n):
            return material.Kd * tm.dot(n, w_i)

    usual, own = facts_of(renderer(scene)), facts_of(renderer(load("cube", brdfs=[Velvet()])))
    assert "BRDFs" not in usual
    assert own["BRDFs"][0].endswith("Velvet")
    assert {key for key in own if own[key] != usual.get(key)} == {"BRDFs"}


def test_samples_of_two_sequences_are_refused_and_the_picture_stays(tmp_path):
    """A file of "niederreiter" whose samples belong to two sequences, without the mean before the last doubling."""
    renderer = tt.A3Renderer(tt.load_scene_data("cube", environment="white"), 4, 4).render(4)
    path = tmp_path / "old.checkpoint"
    renderer.save_checkpoint(path)
    facts, arrays = read_checkpoint(path)
    del arrays["before"]
    write_checkpoint(path, facts, arrays)
    with pytest.raises(tt.InputError, match="old.checkpoint: its samples are of two sequences for each pixel"):
        renderer.load_checkpoint(path)
    assert renderer.samples == 4
