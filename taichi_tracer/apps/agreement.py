"""``taichi-tracer accuracy SCENE --check``: do the estimators agree, and where do they not?"""

import html
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.files import page
from taichi_tracer.files.disk import make_folder, replace_file
from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.studies import agreement
from taichi_tracer.studies.agreement import FALSE_ALARMS, Compared, Group
from taichi_tracer.studies.source import Source
from taichi_tracer.studies.variants import Variant
from taichi_tracer.system import runtime

NAME = "agreement.html"
MARKED = 3.0  # |z| of a block that is named
LEGEND = (
    "Each square is a block of pixels. Blue blocks are darker than those of the estimator that all are compared with, "
    f"red ones brighter; the colour is full where the difference is {MARKED:g} times its standard error. Noise has "
    "both colours without an order; a bias has one."
)
SHOWN = 320  # pixels: the width of a map


def run(args: Namespace, source: Source, estimators: tuple[str, ...] | None, tell: Callable[[str, float], Any]) -> int:
    """Render, and say which estimators differ; 1 if some do.

    Args:
        tell: is called with what is rendered, and the share of the work that is done.
    """
    if args.arch is None:
        runtime.ensure()
    else:
        runtime.init(args.arch)
    if args.report is not None:
        make_folder(Path(args.report), f"--report {args.report}")
    scene = source.load(Variant())
    groups = agreement.agreement(scene, args.size, args.budget, estimators, tell=tell)
    print("\n".join(line for group in groups for line in lines_of(group)))
    print(f"If nothing is biased, {FALSE_ALARMS:.0%} of such checks tell a difference by chance.")
    if args.report is not None:
        path = Path(args.report) / NAME
        replace_file(path, as_page(str(args.scene), groups).encode())
        print(path)
    return 0 if all(group.agrees for group in groups) else 1


def lines_of(group: Group) -> list[str]:
    """What was found of estimators that should agree."""
    head = f"{group.what}: compared with {group.reference}, whose error is {percent(group.of_reference)}"
    return [head, *(f"  {line_of(one)}" for one in group.others)]


def line_of(one: Compared) -> str:
    """What was found of one estimator."""
    shift = f"{one.name:<14} {100 * one.shift:+.2f} % ± {100 * one.error:.2f} %"
    if one.agrees:
        rest = f"; light that no sample met may hide {percent(one.unseen)}" if one.unseen > abs(one.error) / 2 else ""
        return f"{shift}  agrees{rest}"
    word = "bright" if one.z > 0 else "dark"
    count = int((np.sign(one.z) * one.blocks > MARKED).sum())
    where = f", above all in {count} of {one.blocks.size} blocks" if count else ""
    return f"{shift}  differs: too {word} (z {one.z:.1f}){where}"


def coloured(scores: np.ndarray) -> np.ndarray:
    """(h, w, 3) colours of (h, w) numbers from −1, which is blue, over 0, which is grey, to 1, which is red."""
    x = np.clip(scores, -1, 1)[..., None]
    grey, red, blue = np.array([0.25, 0.25, 0.25]), np.array([0.9, 0.15, 0.1]), np.array([0.1, 0.3, 0.95])
    return grey + np.maximum(x, 0) * (red - grey) + np.maximum(-x, 0) * (blue - grey)


def as_page(title: str, groups: list[Group]) -> str:
    """The same as a page, with a map of z for each estimator."""
    parts: list[Any] = [page.paragraph(LEGEND, "note")]
    for group in groups:
        parts.append(f"<h2>{html.escape(lines_of(group)[0])}</h2>")
        parts += [page.picture(coloured(one.blocks / MARKED), line_of(one), SHOWN) for one in group.others]
    return page.page(f"Do the estimators of {title} agree?", parts)
