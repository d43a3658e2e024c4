"""How different two pictures are."""

from argparse import Namespace
from pathlib import Path

import numpy as np

from taichi_tracer.apps.console import Parser
from taichi_tracer.files import page
from taichi_tracer.files.disk import check_place, replace_file
from taichi_tracer.files.images import display_in, read_image
from taichi_tracer.picture.metrics import check_same_size, flip, rel_mse, relative_rmse, rmse
from taichi_tracer.system.argument_types import percentage
from taichi_tracer.system.errors import InputError, digits_of
from taichi_tracer.tones.heat import heat

MOST_PLACES = 5  # largest differences that are printed
SHOWN = 400  # pixels, width of a picture in the page
FEWEST_FOR_FLIP = 8  # pixels on a side


def add_arguments(parser: Parser) -> None:
    """Add what ``compare`` takes."""
    parser.add_argument("first", metavar="A", help="picture: .exr .hdr .pfm .npy .png .jpg")
    parser.add_argument("second", metavar="B", help="picture of the same size, by which A is measured")
    parser.add_argument("--report", metavar="FILE", help="page to write, .html, with both and where they differ")
    parser.add_argument("--tolerance", type=percentage, metavar="PERCENT", help="exit with 1 if they differ by more")
    parser.add_argument("--data", action="store_true", help="PNG and JPEG hold data, such as normals: not sRGB")


def run(args: Namespace) -> int:
    """Print the differences; 1 when they are above ``--tolerance``, and 0 otherwise."""
    image, reference = (linear(path, not args.data) for path in (args.first, args.second))
    check_same_size(image, reference)
    check_place(args.report, ending=".html")
    lines = numbers(image, reference)
    print("\n".join(lines))
    if args.report is not None:
        replace_file(args.report, as_html(args, image, reference, lines).encode())
        print(args.report)
    if args.tolerance is not None and not 100 * relative_rmse(image, reference) <= args.tolerance:
        print(f"the pictures differ by more than {args.tolerance:g} %")
        return 1
    return 0


def linear(path: str, srgb: bool) -> np.ndarray:
    """A picture, whose values are linear and finite: others cannot be compared."""
    picture, display = read_image(path, srgb=srgb), display_in(path)
    if display is not None:
        advice = "compare a file that is linear, such as .exr, or one without --exposure and --tone"
        raise InputError(f"{path}: not linear light, but shown with {display}: {advice}")
    if not np.isfinite(picture).all():
        y, x = np.argwhere(~np.isfinite(picture).all(axis=2))[0]
        raise InputError(f"{path}: the pixel in column {x}, row {y} from the top is not finite")
    return picture


def numbers(image: np.ndarray, reference: np.ndarray) -> list[str]:
    """The differences, a line each; the second picture is what the first is measured by."""
    difference = np.abs(image.astype(np.float64) - reference)
    lines = [
        f"RMSE           {rmse(image, reference):.6g}",
        f"relative RMSE  {100 * relative_rmse(image, reference):.4g} %",
        f"relMSE         {rel_mse(image, reference):.6g}",
    ]
    if min(image.shape[:2]) >= FEWEST_FOR_FLIP:
        lines.append(f"FLIP           {flip(image, reference)[0]:.4g}")
    largest = difference.max(axis=2)
    lines.append(f"pixels that differ: {int((largest > 0).sum())} of {largest.size}")
    for index in np.argsort(largest, axis=None)[::-1][:MOST_PLACES]:
        y, x = np.unravel_index(int(index), largest.shape)
        if largest[y, x] > 0:
            a, b = (digits_of(p[y, x], ".6g") for p in (image, reference))
            lines.append(f"  {largest[y, x]:.6g} in column {x}, row {y} from the top: {a} and {b}")
    return lines


def as_html(args: Namespace, image: np.ndarray, reference: np.ndarray, lines: list[str]) -> str:
    """Both pictures, and where they differ."""
    difference = np.abs(image - reference).max(axis=2)
    largest, width = float(difference.max()), max(SHOWN, min(image.shape[1], 2 * SHOWN))
    parts = [
        f"<pre>{page.html.escape(chr(10).join(lines))}</pre>",
        page.picture(image, args.first, width, not args.data),
        page.picture(reference, args.second, width, not args.data),
        page.picture(heat(difference, largest), f"difference: black 0, white {largest:.3g}", width),
    ]
    if min(image.shape[:2]) >= FEWEST_FOR_FLIP:
        mean, values = flip(image, reference)
        parts.append(page.picture(heat(values, 1.0), f"FLIP, mean {mean:.3g}: black 0, white 1", width))
    return page.page(f"{Path(args.first).name} and {Path(args.second).name}", parts)
