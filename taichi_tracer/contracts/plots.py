"""What a part looks like in numbers: the lobes of a BRDF, the points of a sampler, a curve of tones."""

import html
from collections.abc import Callable
from typing import Any

import numpy as np

from taichi_tracer.contracts import brdfs, samplers
from taichi_tracer.studies.drawing import COLOURS, FONT, INK, dress, svg_of

ANGLES = (0, 30, 60, 80)  # degrees of the viewer with the normal
POINTS = 256  # of a sampler
SIZE = 4.2  # inches of a drawing


def plots_of(part: Any) -> list[str]:
    """Drawings of a part as HTML; none of a kind that pictures show better."""
    draw = {"BRDF": lobes, "sampler": points, "tone curve": curve}.get(part.kind)
    return [] if draw is None else draw(part)


def lobes(brdf: Any) -> list[str]:
    """f_r cos θ and pdf in the plane of the normal and the viewer, for each of its materials and some viewers."""
    bench, n = brdfs.Bench(brdf), np.array([0.0, 0.0, 1.0])
    theta = np.radians(np.linspace(-90, 90, 721))
    w_i = np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=1)
    drawings = []
    for which, material in list(enumerate(bench.materials))[:4]:

        def draw(axes, which=which):
            for k, angle in enumerate(ANGLES):
                w_o = np.array([-np.sin(np.radians(angle)), 0.0, np.cos(np.radians(angle))])
                f, pdf, _ = bench.values(which, w_o, n, w_i)
                f_cos = f.mean(axis=1) * np.cos(theta).clip(0)
                axes.plot(theta, f_cos, color=COLOURS[k], label=f"viewer at {angle}°: f cos θ")
                axes.plot(theta, pdf, color=COLOURS[k], linestyle="--", label="pdf" if k == 0 else None)

        told = brdfs.told(material) or "the usual material"
        drawings.append(figure_of(polar(f"lobe {which}", draw), told))
    return drawings


def figure_of(drawing: str, caption: str) -> str:
    """A drawing with a line below it."""
    return f"<figure>{drawing}<figcaption>{html.escape(caption)}</figcaption></figure>"


def polar(name: str, draw: Callable) -> str:
    """A drawing over the angle with the normal, which points upwards."""
    from matplotlib.ticker import MaxNLocator

    figure, axes = new_figure(subplot_kw={"projection": "polar"})
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_thetamin(-90)
    axes.set_thetamax(90)
    draw(axes)
    axes.tick_params(colors=INK, labelsize=FONT - 3)
    axes.yaxis.set_major_locator(MaxNLocator(3))
    axes.set_facecolor("none")
    axes.legend(fontsize=FONT - 3, loc="upper center", bbox_to_anchor=(0.5, 0.12), frameon=False, labelcolor=INK)
    return svg_of(figure, name)


def points(sampler: Any) -> list[str]:
    """The first points of a pixel, in the first two dimensions and across them."""
    if not hasattr(sampler, "get_2d"):
        return []
    found = samplers.numbers(samplers.bound(sampler), samplers.keys_of_samples(5, 3, POINTS), 2)
    drawings, x = [], found[:, 0, 0]
    for name, y in (("first pair", found[:, 0, 1]), ("first number of two pairs", found[:, 1, 0])):
        figure, axes = new_figure()
        axes.plot(x, y, ".", color=COLOURS[0], markersize=4)
        axes.set_aspect("equal")
        dress(axes, "")
        drawings.append(figure_of(svg_of(figure, name), f"{name}: {POINTS} samples of a pixel"))
    return drawings


def curve(tone: Any) -> list[str]:
    """The curve from 0 to white."""
    x = np.linspace(0, tone.white, 400)
    figure, axes = new_figure()
    axes.plot(x, np.asarray(tone.curve(x.copy())), color=COLOURS[0])
    dress(axes, "")
    return [figure_of(svg_of(figure, "curve"), "what light becomes, from 0 to white")]


def new_figure(**options: Any) -> Any:
    """(figure, axes) of the size of a drawing, without a display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(SIZE, SIZE), layout="tight")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(**options)
