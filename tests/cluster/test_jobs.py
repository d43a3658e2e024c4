"""Many pictures, each done by one worker; and a class that is graded."""

import numpy as np
import pytest

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
