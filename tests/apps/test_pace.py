"""How often something is done that takes time, and how many points a curve keeps."""

import numpy as np
import pytest

from taichi_tracer.apps.pace import MOST_POINTS, Rarely, thinned


def test_it_takes_at_most_its_share():
    rarely = Rarely(0.5, 0.1)
    rarely.done(0.0, 3.0)  # the first time compiles
    assert rarely.next == pytest.approx(3.5)
    rarely.done(4.0, 4.2)
    assert rarely.next == pytest.approx(4.2 + 2.0)
    rarely.done(7.0, 7.1)
    assert rarely.next == pytest.approx(7.1 + 1.5)
    for _ in range(20):
        rarely.done(9.0, 9.001)
    assert rarely.next == pytest.approx(9.501)
    rarely.begin()
    assert rarely.next == -np.inf


def test_the_pause_has_an_end_whatever_it_takes():
    rarely = Rarely(0.3, 0.025, 0.45)
    rarely.done(0.0, 3.0)
    rarely.done(4.0, 4.2)
    assert rarely.next == pytest.approx(4.2 + 0.45)


@pytest.mark.parametrize("count", [0, 1, 2, MOST_POINTS, MOST_POINTS + 1, 2 * MOST_POINTS + 1, 5000])
def test_a_thinned_curve_keeps_its_end(count):
    curve = list(range(count))
    found = thinned(curve)
    assert len(found) <= MOST_POINTS
    assert found[-1:] == curve[-1:]
    assert len(set(np.diff(found))) <= 1
