"""The rows of a profile add up, and nothing is shown that was not measured."""

import numpy as np
import pytest

from taichi_tracer.studies.profile import EYE_RAYS, FILM_TAKES, RAYS, SHADING, Profile, as_page, described
from taichi_tracer.studies.sample_times import PixelRays, SampleTimes
from taichi_tracer.system.compiling import Kernel
from taichi_tracer.system.stopwatch import IMPORTS, OTHER, SAMPLES, STAGES, Stopwatch

PARTED = SampleTimes(
    whole=0.08,
    film=0.01,
    rays=0.04,
    eye=0.0,
    shading=0.03,
    share=0.25,
    rays_counted=PixelRays(100, 50, 25),
    seconds=1.5,
)


@pytest.fixture
def profile():
    """Ten seconds, of which seven went into samples."""
    watch = Stopwatch(0.0, IMPORTS)
    watch.seconds = dict.fromkeys(STAGES, 0.0) | {IMPORTS: 2.0, SAMPLES: 7.0, OTHER: 1.0}
    watch._since = 10.0
    kernels = [Kernel("_take_samples", 1.0, 0.5, 1.25, 0.9), Kernel("_clear", 2.0, 0.01, 0.002, 0.002)]
    return Profile("box", watch, kernels, PARTED, passes=8)


def test_the_samples_are_divided_as_they_were_measured(profile):
    rows = dict(profile.rows())
    shares = np.array([PARTED.eye, PARTED.shading, PARTED.rays, PARTED.film])
    assert [rows[name] for name in (EYE_RAYS, SHADING, RAYS, FILM_TAKES)] == pytest.approx(7 * shares / shares.sum())
    assert SAMPLES not in rows
    assert sum(rows.values()) == pytest.approx(profile.total)
    assert profile.rays() == [
        ("eye rays", 800, rows[EYE_RAYS]),
        ("shadow rays and further rays", 600, rows[RAYS]),
    ]


def test_the_text_and_the_page_have_every_row(profile):
    text, page = described(profile), as_page(profile)
    for name, seconds in profile.rows():
        assert f"{seconds:.3f}" in text
        assert name in text
        assert name in page
    assert "2 kernels, 1 of them translated anew (1.25 s)" in text
    assert "25 % of the pixels" in page
    assert "src=" not in page
    assert "href=" not in page
