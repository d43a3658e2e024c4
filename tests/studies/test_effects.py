"""What effects cost that a scene does not call for: which differences are noise."""

import numpy as np
import pytest

from taichi_tracer.studies.effects import CompiledVariant, ratio_of, table
from taichi_tracer.studies.study import Interval


def test_the_interval_of_a_ratio_holds_its_median_in_95_of_100_studies():
    rng = np.random.default_rng(5)
    inside = []
    for _ in range(1000):
        base = list(rng.gamma(20, size=9))
        ratio, low, high = ratio_of([1.3 * b * e for b, e in zip(base, rng.lognormal(0, 0.2, 9), strict=True)], base)
        assert low <= ratio <= high
        inside.append(low <= 1.3 <= high)
    assert 0.94 <= np.mean(inside) <= 0.98  # 96.1 % for nine runs; the standard error is 0.6 %


@pytest.mark.parametrize(
    ("ratio", "words"),
    [
        ((0.9, 0.7, 1.1), "noise (0.7 to 1.1)"),
        ((1.3, 1.2, 1.4), "× 1.30 (1.20 to 1.40)"),
        ((1, 0.99, 1.01), "the same"),
    ],
)
def test_a_table_says_what_is_noise(ratio, words):
    base, reasons = CompiledVariant("as it is", 1.0, 5.0, True), [("phong", False, "no triangle"), ("rays", True, "x")]
    _, _, phong, rays, wrong, *_ = table(
        [base, CompiledVariant("phong", 1.0, 5.0, True, Interval(*ratio)), CompiledVariant("all", 1.0, 5.0, False)],
        reasons,
    )
    assert phong.split("  ")[0] == "phong"
    assert words in phong
    assert phong.endswith("no triangle")
    assert rays.split() == ["rays", "yes", "x"]
    assert wrong.endswith("DIFFERENT PICTURE")
