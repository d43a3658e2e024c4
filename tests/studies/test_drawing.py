"""Labels of charts do not touch, and ticks have room."""

import numpy as np
import pytest

from taichi_tracer.studies import drawing


def test_the_ticks_of_an_axis_have_room():
    """1 is always named, and others beside it where there is room."""
    from matplotlib.figure import Figure

    for width in (1.2, 3.0, 12.0):
        axes = Figure(figsize=(width, 2)).add_axes((0, 0, 1, 1))
        axes.set_xscale("log")
        axes.set_xlim(0.12, 4.6)
        drawing.set_ticks(axes.xaxis, 0.12, 4.6, str)
        ticks = axes.xaxis.get_majorticklocs()
        assert 1 in ticks
        assert len(ticks) >= (1 if width < 2 else 2)


def test_labels_never_touch():
    places = drawing.spread([0.1, 0.1, 0.11, 0.5, 0.52, 0.9], 0.05)
    gaps = np.diff(places)
    assert (gaps >= 0.05 - 1e-12).all()
    assert places[5] == pytest.approx(0.9)
    assert np.mean(places[:3]) == pytest.approx(np.mean([0.1, 0.1, 0.11]))
