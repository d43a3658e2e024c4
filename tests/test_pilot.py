"""``use("auto")``: what reaches an error soonest is taken and told, and the samples are those of one estimator."""

import math
from pathlib import Path

import numpy as np
import pytest
from support import long_except

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.picture.progress import Target
from taichi_tracer.pilot import LARGER, Pilot, Trial, time_of, told

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def scene():
    return tt.load_scene_data("cube", environment="studio")


def trial(name, seconds, error, unseen=0.0):
    return Trial(name, False, seconds, RelativeError(error, error / 2, 2 * error, unseen))


@pytest.fixture
def measured(monkeypatch):
    """Makes the trials what a test says: name → (seconds of a sample, error after 16 samples)."""

    def are(**by_name):
        def tried(self, copy, renderer, name, target):
            return trial(name, *by_name.get(name, (1.0, 10.0)))

        monkeypatch.setattr(Pilot, "tried", tried)

    return are


def test_the_time_to_an_error_grows_with_the_samples_that_it_needs():
    """A tenth of the error needs 10^(1/0.7) = 26.8 times the samples."""
    one = trial("mis", 0.5, 0.2)
    assert one.seconds_to(0.2) == pytest.approx(8)
    assert one.seconds_to(0.02) == pytest.approx(8 * 10 ** (1 / 0.7))
    assert one.error_after(one.seconds_to(0.03)) == pytest.approx(0.03)
    assert trial("mis", 0.5, 0.3, 0.4).seconds_to(0.5) == pytest.approx(8)  # light that no sample met counts
    assert trial("mis", 0.5, math.nan).seconds_to(0.5) == math.inf


def test_the_first_target_that_is_reached_says_how_long_it_takes():
    one = trial("mis", 0.5, 0.2)
    assert time_of(Target(error=0.02), one) == pytest.approx(8 * 10 ** (1 / 0.7))
    assert time_of(Target(time=3.0, error=0.02), one) == 3
    assert time_of(Target(spp=4, time=3.0), one) == 2


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.123, "0.12 s"), (9.94, "9.9 s"), (80.2, "80 s"), (7200, "2 h"), (math.inf, "unknown")]
)
def test_seconds_are_told_in_two_digits(seconds, text):
    assert told(seconds) == text


def test_the_best_is_taken_and_told_with_all_numbers(scene, measured):
    measured(mis=(1.0, 0.2), environment=(1.0, 0.02))
    renderer = tt.A3Renderer(scene, 16, 16).use("auto")
    assert str(renderer.pilot) == "auto: nothing is rendered yet"
    renderer.render(100)
    assert (renderer.active.name, renderer.samples) == ("environment", 100)
    names = [one.name for one in renderer.pilot.trials]
    assert names[0] == "environment"
    assert set(names) | set(renderer.pilot.left_out) == set(renderer.names()) - {"microfacet"}
    text = str(renderer.pilot)
    assert text.startswith("auto: environment: ")
    assert f"; mis {told(renderer.pilot.trials[names.index('mis')].seconds_to(renderer.pilot.wanted))}" in text
    assert f"{'estimator':<15} {text}" in renderer.receipt()


def test_the_usual_estimator_stays_unless_another_is_clearly_faster(scene, measured):
    measured(mis=(1.0, 0.2), environment=(1.0, 0.2 / (0.9 * LARGER) ** 0.7))
    assert tt.A3Renderer(scene, 16, 16).use("auto").render(100).active.name == "mis"


@pytest.mark.parametrize("winner", ["mis", "brdf"])
def test_the_samples_are_those_of_the_estimator_alone(scene, measured, winner):
    """If the usual one wins, those of the pilot are the first ones; the number is what was asked for."""
    measured(**{winner: (1e-9, 1e-3)})
    renderer = tt.A3Renderer(scene, 16, 16, seed=5).use("auto").render(12)
    assert (renderer.active.name, renderer.samples) == (winner, 12)
    alone = tt.A3Renderer(scene, 16, 16, seed=5).use(winner).render(12)
    np.testing.assert_array_equal(renderer.image(), alone.image())
    renderer.render(3)
    np.testing.assert_array_equal(renderer.image(), alone.render(3).image())


def test_what_takes_too_long_is_left_out_and_named(scene, monkeypatch):
    def tried(self, copy, renderer, name, target):
        self.compile_seconds += 1e6 if name != "mis" else 0.0
        return trial(name, 1e-3, 0.1)

    monkeypatch.setattr(Pilot, "tried", tried)
    renderer = tt.A3Renderer(scene, 16, 16).use("auto").render(8)
    assert [one.name for one in renderer.pilot.trials] == ["mis", "environment"]
    assert str(renderer.pilot).endswith("no time to try brdf, mis_balance, mis_one_sample, uniform, hemisphere")


def test_a_choice_holds_until_the_picture_changes(scene, measured):
    renderer = tt.A3Renderer(scene, 16, 16).use("auto")
    measured(brdf=(1e-9, 1e-3))
    assert renderer.render(8).active.name == "brdf"
    measured(environment=(1e-9, 1e-3))
    renderer.seed = 3
    renderer.begin_anew()
    assert (renderer.render(8).active.name, renderer.samples) == ("brdf", 8)
    renderer.camera.set_camera_parameters(eye=(2, 3, 5))
    assert (renderer.render(8).active.name, renderer.samples) == ("environment", 8)
    renderer.use("mis")
    assert renderer.pilot is None
    assert renderer.render(2).active.name == "mis"


def test_a_checkpoint_wants_the_name_of_the_estimator(tmp_path, capsys):
    file = tmp_path / "a.checkpoint"
    words = ["--checkpoint", str(file), "-o", str(tmp_path / "a.png")]
    assert main(["render", "cube", "--estimator", "auto", *words]) == 2
    assert "keeps the samples of one estimator: name it, not auto" in capsys.readouterr().err
    assert list(Path(tmp_path).iterdir()) == []


@pytest.mark.parametrize("environment", long_except(["white", None], None))
def test_where_nothing_errs_or_nothing_shines_the_usual_estimator_stays_or_a_cheaper_one_is_taken(environment):
    """Samples of the BRDF have no error on a convex body under even light; without light, no error is known."""
    made = tt.load_scene_data("cube", environment=environment)
    renderer = tt.A3Renderer(made, 16, 16).use("auto").render(100)
    assert renderer.samples == 100
    assert {one.name for one in renderer.pilot.trials} <= set(renderer.names())
    assert str(renderer.pilot).startswith("auto: ")
    if environment is None:
        assert renderer.active.name == "mis"
