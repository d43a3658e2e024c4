"""Numbers in tables: as ``format`` writes them, and no −0."""

import re

import numpy as np
import pytest

from taichi_tracer.ray import RayHits
from taichi_tracer.studies import effects
from taichi_tracer.system.errors import digits


@pytest.mark.parametrize(
    ("value", "spec", "text"),
    [
        (-0.0, "g", "0"),
        (-0.0, ".2f", "0.00"),
        (-0.001, ".2f", "0.00"),
        (-0.004, "9.2f", "     0.00"),
        (np.float32(-0.0), ".4g", "0"),
        (-1e-300, ".0e", "-1e-300"),
        (-0.4, ",.0f", "0"),
        (-0.0, "+.9g", "+0"),
        (-0.005001, ".2f", "-0.01"),
        (-0.1, "g", "-0.1"),
        (-20, "g", "-20"),
        (-1000.5, ",.1f", "-1,000.5"),
        (float("-inf"), "g", "-inf"),
        (float("nan"), ".2f", "nan"),
        (0.0, ".2f", "0.00"),
        (3.14159, ".3g", "3.14"),
    ],
)
def test_zero_has_no_sign_and_the_rest_is_as_python_writes_it(value, spec, text):
    assert digits(value, spec) == text


def test_no_table_shows_minus_zero():
    zeros = np.full((1, 3), -0.0)
    hits = RayHits(
        np.array([True]),
        zeros[:, 0],
        np.array([1]),
        zeros[:, :2],
        zeros,
        zeros,
        np.array([0]),
        np.array([False]),
        zeros,
    )
    lines = [
        hits._repr_html_(),
        *effects.table(
            [effects.CompiledVariant("a", -0.001, 1.0, True), effects.CompiledVariant("b", -0.0, 1.0, True)]
        ),
    ]
    assert [line for line in lines if re.search(r"-0(\.0+)?(?![.\d])", line)] == []
