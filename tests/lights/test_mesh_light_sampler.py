"""The handout's sampler of mesh lights, beside what all choices of lamps do: where it is, and what it refuses."""

from types import SimpleNamespace

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer import sampler


def test_it_is_found_where_the_handout_looks_for_it():
    assert sampler.MeshLightSampler is tt.MeshLightSampler


def test_a_sphere_that_emits_is_refused():
    with pytest.raises(tt.InputError, match="samples triangles, but a sphere emits: use lamp_choice='power'"):
        tt.MeshLightSampler().prepare(SimpleNamespace(primitives=np.array([3, -1])))
