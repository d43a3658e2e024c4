"""Every registered choice of lamps, and the handout's, keeps its contract; those that break it are found."""

import pytest

import taichi_tracer as tt
from contracts.registered import every
from taichi_tracer.contracts import lamp_choices

pytestmark = pytest.mark.usefixtures("f32")


@every("lamp choice", alike=("area",))
def test_lamp_choice(part):
    lamp_choices.check_lamp_choice(part)


def test_the_handouts_sampler_of_mesh_lights():
    lamp_choices.check_lamp_choice(tt.MeshLightSampler)


# ── mistakes ──
