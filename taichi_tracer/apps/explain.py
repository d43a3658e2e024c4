"""``taichi-tracer explain``: every number on the way from one pixel to its colour."""

from argparse import Namespace
from dataclasses import dataclass

import numpy as np

from taichi_tracer.apps.requests import PictureRequest, SceneRequest, scene_and_pictures_of
from taichi_tracer.apps.words import note
from taichi_tracer.explain.explanation import Explanation
from taichi_tracer.files import page
from taichi_tracer.files.disk import check_place, replace_file
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.system.errors import InputError

STYLE = """
summary { cursor: pointer; } summary, details div { margin: 2px 0; } code { font-size: 0.9em; }
em { color: var(--soft); } pre { overflow-x: auto; background: var(--band); padding: 8px; }
"""


@dataclass(frozen=True)
class ExplainRequest:
    """One pixel of a picture.

    Attributes:
        pixel: (column, row) from the left and from the top; None if ``kind`` says which.
        kind: "pixel"; "worst" for the pixel with the largest standard error; "non_finite" for the first sample that is
            not finite.
        sample: which of its samples, counted from 0.
        json, html: files to write; or None.
    """

    scene: SceneRequest
    picture: PictureRequest
    pixel: tuple[int, int] | None
    kind: str
    sample: int
    json: str | None
    html: str | None


def explain_of(args: Namespace) -> ExplainRequest:
    """What the options ask for."""
    scene, pictures = scene_and_pictures_of(args)
    if len(pictures) > 1 or len(pictures[0].views) > 1:
        raise InputError("explain takes one picture: name one with --view or --estimator")
    kinds = [kind for kind in ("pixel", "worst", "non_finite") if getattr(args, kind)]
    if len(kinds) != 1:
        raise InputError("explain needs one of --pixel X Y, --worst and --non-finite")
    for path in (args.json, args.html):
        if path is not None:
            check_place(path)
    pixel = None if args.pixel is None else tuple(args.pixel)
    return ExplainRequest(scene, pictures[0], pixel, kinds[0], args.sample, args.json, args.html)


def run(args: Namespace) -> int:
    """Explain one sample of one pixel."""
    request = explain_of(args)
    scene = request.scene.load()
    renderer_class, integrator = request.picture.views[0]
    renderer = request.picture.make_renderer(renderer_class, scene).use(integrator)
    samples = max(request.picture.spp, request.sample + 1)
    found = find(renderer, request, samples)
    if found is None:
        print(f"all {renderer.samples} samples of every pixel are finite")
        return 0
    explanation = renderer.explain(*found, samples)
    print(explanation)
    if request.json is not None:
        replace_file(request.json, explanation.to_json().encode())
        print(request.json)
    if request.html is not None:
        replace_file(request.html, as_page(explanation).encode())
        print(request.html)
    return 0


def find(renderer: ProgressiveRenderer, request: ExplainRequest, samples: int) -> tuple[int, int, int] | None:
    """(column, row, sample) of what is to be explained; None if no sample is odd. It renders only what it must."""
    if request.pixel is not None:
        return (*request.pixel, request.sample)
    renderer.render(samples)
    if request.kind == "worst":
        errors = np.nan_to_num(renderer.error_image()).sum(axis=2)
        row, column = np.unravel_index(int(errors.argmax()), errors.shape)
        note(f"the largest standard error, {errors[row, column] / 3:.4g}, is in column {column}, row {row}")
        return int(column), int(row), request.sample
    places = renderer.film.non_finite_samples()
    if not places:
        return None
    x, y, sample = places[0]
    note(f"{renderer.non_finite} samples are not finite; the first is explained")
    return x, renderer.height - 1 - y, sample - renderer.first_sample


def as_page(explanation: Explanation) -> str:
    """A page that needs no other file."""
    title = f"Pixel ({explanation.column}, {explanation.row}), sample {explanation.sample}"
    return page.page(title, [explanation._repr_html_()], STYLE)
