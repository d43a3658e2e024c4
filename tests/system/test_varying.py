"""Varying numbers are the usual numbers for Python."""

import json
import pickle

import numpy as np
import pytest

from taichi_tracer.system.varying import VaryingFloat, VaryingInt, varying


@pytest.mark.parametrize(("value", "kind"), [(3, VaryingInt), (np.int32(3), VaryingInt), (0.5, VaryingFloat)])
def test_a_varying_number_is_the_number(value, kind):
    found = varying(value)
    assert type(found) is kind
    assert found == value
    assert hash(found) == hash(value)
    assert f"{found}" == f"{value}"
    assert json.loads(json.dumps(found)) == value
    assert pickle.loads(pickle.dumps(found)) == value
    assert type(found + 1) in (int, float)


def test_tuples_hold_varying_numbers():
    found = varying(((0, 8), (2, 0.25)))
    assert found == ((0, 8), (2, 0.25))
    assert [type(one) for pair in found for one in pair] == [VaryingInt, VaryingInt, VaryingInt, VaryingFloat]
