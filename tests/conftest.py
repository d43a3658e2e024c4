"""Taichi in each precision, and random numbers."""

import os

import numpy as np
import pytest
from support import start


@pytest.fixture(scope="module")
def f32():
    """Taichi in f32."""
    start("f32")


@pytest.fixture(scope="module", params=["f32", "f64"])
def precision(request):
    """Taichi in each precision; its name."""
    start(request.param)
    return request.param


@pytest.fixture
def rng():
    """Random numbers that are the same in every run."""
    return np.random.default_rng(20)


# What takes seconds and repeats by the command line, on more scenes or with more samples what others test too. These
# run with TAICHI_TRACER_LONG=1, as in .ci/run.
LONG = (
    "apps/test_cli.py::test_a_killed_render",
    "apps/test_cli.py::test_effects_prints",
    "apps/test_cli.py::test_estimators_are_lit",
    "apps/test_cli.py::test_every_view_is_the_renderers",
    "apps/test_cli.py::test_seeds_and_samplers",
    "apps/test_cli_rt3.py::test_an_exported_scene",
    "test_adaptive.py::test_it_is_unbiased",
    "test_adaptive.py::test_packets_take",
    "test_bvh_build.py::test_with_fast_math",
    "test_direct_illumination.py::test_diffuse_wall_under_constant_light[environment",
    "test_direct_illumination.py::test_diffuse_wall_under_constant_light[hemisphere",
    "test_direct_illumination.py::test_diffuse_wall_under_constant_light[mis_balance",
    "test_direct_illumination.py::test_every_estimator_agrees_with_every_other[cornell_box",
    "test_direct_illumination.py::test_low_discrepancy",
    "test_direct_illumination.py::test_secondary_rays",
    "test_direct_illumination.py::test_the_suns_samplers",
    "test_effects.py::test_everything_compiled_in_gives_the_same_bits[cube",
    "test_effects.py::test_everything_compiled_in_gives_the_same_bits[sphere-",
    "test_effects.py::test_the_study",
    "test_error_estimate.py::test_renders_know_their_error[independent",
    "test_hard_cases.py::test_a_broken_triangle_test",
    "test_interactive.py::test_a2_without",
    "test_primary_hits.py::test_packets_equal_single_rays_bit_for_bit[moller",
    "test_reproducible.py::test_threads_and_processes",
    "test_reproducible.py::test_two_halves_merged_are_the_whole[independent",
    "test_rt3_renderer.py::test_a_crop_is_cut_out",
    "test_scene_data.py::test_a_million_rays",
    "test_spheres.py::test_a_sphere_is_its_own",
    "test_spheres.py::test_spheres_among_triangles",
)


def pytest_collection_modifyitems(items):
    """Mark what is long, and skip it unless it is asked for."""
    runs_all = os.environ.get("TAICHI_TRACER_LONG") == "1"
    for item in items:
        if item.nodeid.removeprefix("tests/").startswith(LONG):
            item.add_marker(pytest.mark.long)
            if not runs_all:
                item.add_marker(pytest.mark.skip(reason="long: TAICHI_TRACER_LONG=1 runs it"))
