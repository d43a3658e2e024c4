"""Every number on the way from one pixel to its colour."""

from argparse import Namespace

import numpy as np

from taichi_tracer.apps.console import Parser, note
from taichi_tracer.apps.pictures import request_of
from taichi_tracer.explain.explanation import Explanation
from taichi_tracer.files import page
from taichi_tracer.files.disk import check_place, replace_file
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.settings import OF_PICTURE, OF_SCENE, RenderSettings, add_option, add_scene
from taichi_tracer.system.argument_types import whole

STYLE = """
summary { cursor: pointer; } summary, details div { margin: 2px 0; } code { font-size: 0.9em; }
em { color: var(--soft); } pre { overflow-x: auto; background: var(--band); padding: 8px; }
"""


def add_arguments(parser: Parser) -> None:
    """Add what ``explain`` takes."""
    add_scene(parser, *OF_SCENE, *OF_PICTURE)
    which = parser.add_argument_group("which pixel", "one of --pixel, --worst and --non-finite")
    one = which.add_mutually_exclusive_group(required=True)
    one.add_argument(
        "--pixel", type=whole, nargs=2, metavar=("X", "Y"), help="column from the left and row from the top, from 0"
    )
    one.add_argument(
        "--worst", action="store_true", help="the pixel with the largest standard error, and the sample that makes it"
    )
    one.add_argument("--non-finite", action="store_true", help="the first sample that is infinite or not a number")
    which.add_argument(
        "--sample",
        type=whole,
        metavar="K",
        help="which sample of it (default: 0, and with --worst the one that is farthest from the mean)",
    )
    add_option(which, "spp")
    parser.add_argument("--json", metavar="FILE", help="write all steps as JSON, too")
    parser.add_argument("--html", metavar="FILE", help="write a page with a drawing, too")


def run(args: Namespace) -> int:
    """Explain one sample of one pixel."""
    request = request_of(RenderSettings.of(args))
    picture = request.single("explain")
    check_place(args.json, ending=".json")
    check_place(args.html, ending=".html")
    renderer = picture.make_renderer(request.load())
    samples = max(picture.target.spp, (args.sample or 0) + 1)
    found = find(renderer, args, samples)
    if found is None:
        print(f"all {renderer.samples} samples of every pixel are finite")
        return 0
    if args.html is not None and renderer.film.samples == 0:
        renderer.render(1)  # the thumbnail of the page
    explanation = renderer.explain(*found, samples)
    print(explanation)
    for path, as_text in ((args.json, Explanation.to_json), (args.html, as_page)):
        if path is not None:
            replace_file(path, as_text(explanation).encode())
            print(path)
    return 0


def find(renderer: ProgressiveRenderer, args: Namespace, samples: int) -> tuple[int, int, int | None] | None:
    """(column, row, sample) of what is to be explained; None if no sample is odd. It renders only what it must."""
    if args.pixel is not None:
        return (*args.pixel, args.sample or 0)
    renderer.render(samples)
    if args.worst:
        errors = np.nan_to_num(renderer.error_image()).sum(axis=2)
        row, column = np.unravel_index(int(errors.argmax()), errors.shape)
        note(f"the largest standard error, {errors[row, column] / 3:.4g}, is in column {column}, row {row}")
        return int(column), int(row), args.sample
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
