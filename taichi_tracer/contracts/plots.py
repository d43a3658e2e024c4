"""What a part looks like in numbers: the lobes of a BRDF, the points of a sampler, a curve of tones."""

from collections.abc import Iterator
from html import escape
from typing import Any

import numpy as np

from taichi_tracer.contracts import brdfs, samplers
from taichi_tracer.files.drawing import COLOURS, FONT, INK, dress, svg_of

ANGLES = (0, 30, 60, 80)  # degrees of the viewer with the normal
POINTS = 256  # of a sampler
SIZE = 4.2  # inches of a drawing
Drawings = Iterator[tuple[Any, str]]  # figures with their captions


def plots_of(part: Any) -> list[str]:
    """Drawings of a part as HTML; none of a kind that pictures show better."""
    drawings = {"BRDF": lobes, "sampler": points, "tone curve": curve}.get(part.kind, lambda part: ())(part)
    return [
        f"<figure>{svg_of(figure, text)}<figcaption>{escape(text)}</figcaption></figure>" for figure, text in drawings
    ]


def lobes(brdf: Any) -> Drawings:
    """f_r cos θ and pdf in the plane of the normal and the viewer, for each of its materials and some viewers."""
    from matplotlib.ticker import MaxNLocator

    bench, n = brdfs.Bench(brdf), np.array([0.0, 0.0, 1.0])
    theta = np.radians(np.linspace(-90, 90, 721))
    w_i = np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=1)
    for which, material in enumerate(bench.materials[:4]):
        figure, axes = new_figure(subplot_kw={"projection": "polar"})
        axes.set(theta_zero_location="N", theta_direction=-1, thetamin=-90, thetamax=90, facecolor="none")
        for angle, colour in zip(ANGLES, COLOURS, strict=False):
            w_o = np.array([-np.sin(np.radians(angle)), 0.0, np.cos(np.radians(angle))])
            f, pdf, _ = bench.values(which, w_o, n, w_i)
            axes.plot(theta, f.mean(axis=1) * np.cos(theta).clip(0), color=colour, label=f"viewer at {angle}°: f cos θ")
            axes.plot(theta, pdf, color=colour, linestyle="--", label="pdf" if angle == ANGLES[0] else None)
        axes.tick_params(colors=INK, labelsize=FONT - 3)
        axes.yaxis.set_major_locator(MaxNLocator(3))
        axes.legend(fontsize=FONT - 3, loc="upper center", bbox_to_anchor=(0.5, 0.12), frameon=False, labelcolor=INK)
        yield figure, f"lobe {which}: {brdfs.shown(material) or 'the usual material'}"


def points(sampler: Any) -> Drawings:
    """The first points of a pixel, in the first two dimensions and across them."""
    if hasattr(sampler, "get_2d"):
        found = samplers.numbers(samplers.bound(sampler), samplers.keys_of_samples(5, 3, POINTS), 2)
        for name, y in (("first pair", found[:, 0, 1]), ("first number of two pairs", found[:, 1, 0])):
            figure, axes = new_figure()
            axes.plot(found[:, 0, 0], y, ".", color=COLOURS[0], markersize=4)
            axes.set_aspect("equal")
            dress(axes, "")
            yield figure, f"{name}: {POINTS} samples of a pixel"


def curve(tone: Any) -> Drawings:
    """The curve from 0 to white."""
    x = np.linspace(0, tone.white, 400)
    figure, axes = new_figure()
    axes.plot(x, np.asarray(tone.curve(x.copy())), color=COLOURS[0])
    dress(axes, "")
    yield figure, "what light becomes, from 0 to white"


def new_figure(**options: Any) -> Any:
    """(figure, axes) of the size of a drawing, without a display."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(SIZE, SIZE), layout="tight")
    return figure, figure.subplots(**options)
