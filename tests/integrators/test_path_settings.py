"""Which bounces count: their names, which of them can be added up, and the shortest paths that are enough."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.contracts.lab import WHOLE, Rows
from taichi_tracer.integrators.base import Control
from taichi_tracer.integrators.path_settings import MOST_BOUNCES, MOST_SURVIVAL, PathSettings, check_terms
from taichi_tracer.settings import name_of_bounces


@pytest.fixture(scope="module")
def settings():
    tt.system.runtime.ensure()
    return PathSettings()


def test_bounces_are_named_as_the_command_line_takes_them():
    terms = ((0, 0), (1, 1), (1, 3), (4, None))
    assert [name_of_bounces(one) for one in terms] == ["0", "1", "1-3", "4+"]


@pytest.mark.parametrize(
    ("terms", "told"),
    [
        ([(0, 0), (0, 2)], "bounces 0 and 0-2 both count 0"),
        ([(3, None), (5, 5)], r"bounces 3\+ and 5 both count 5"),
        ([(7, 7)], "bounces 7: paths make at most 5 bounces: give a larger max_bounces"),
    ],
)
def test_terms_that_cannot_be_added_up_are_refused(terms, told):
    with pytest.raises(tt.InputError, match=told):
        check_terms(terms, 5)


def test_terms_that_can_be_added_up():
    check_terms([(0, 0), (4, None), (1, 3)], 5)
    check_terms([(0, 9)], 5)


def test_paths_end_after_the_last_bounce_that_counts(settings):
    for bounces, most in ((None, 9), ((2, 2), 2), ((0, None), 9), ((3, 20), 9), ((0, 0), 0)):
        settings.set(max_bounces=9, bounces=bounces)
        assert settings._numbers._field[0] == most
        assert settings["max_bounces"] == 9
    settings.set(bounces=None)


@pytest.mark.parametrize("value", [3, (3, 1), (0, 65), (None, 2), (-1, None), (1, 2, 3), "12"])
def test_what_is_no_range_of_bounces_is_refused(settings, value):
    told = rf"bounces must be \(first, last\) with 0 <= first <= last <= {MOST_BOUNCES}"
    with pytest.raises(tt.InputError, match=told):
        settings.set(bounces=value)


def test_a_list_becomes_a_pair(settings):
    settings.set(bounces=[1, 2])
    assert settings["bounces"] == (1, 2)
    settings.set(bounces=None)


def test_controls_are_those_that_have_an_effect(settings):
    def names(**values):
        settings.set(**values)
        return [control.name for control in settings.controls()]

    usual = ["max_bounces", "bounces", "roulette", "rr_start_bounce"]
    assert names(roulette="throughput") == usual
    assert names(roulette="course", max_bounces=0, bounces=(0, 0)) == [*usual, "rr_termination_probability"]
    assert settings.controls()[1] == Control("bounces", "0", names=["all", "0"])


def test_a_path_goes_on_with_the_probability_of_the_roulette(settings):
    """Before its start always; then with 1 − q, or with the largest throughput, which is at most ``MOST_SURVIVAL``."""
    throughput = np.array([[0.2, 0.5, 0.1], [3.0, 1.0, 1.0]])
    depth = np.array([4, 4])
    survival = Rows(settings.survival, (WHOLE, 3), (1,))
    settings.set(rr_start_bounce=3, rr_termination_probability=0.3, roulette="course")
    np.testing.assert_allclose(np.ravel(survival(depth, throughput)), 0.7, rtol=1e-6)
    np.testing.assert_allclose(np.ravel(survival(depth - 1, throughput)), 1.0)
    settings.set(roulette="throughput")
    np.testing.assert_allclose(np.ravel(survival(depth, throughput)), [0.5, MOST_SURVIVAL], rtol=1e-6)
