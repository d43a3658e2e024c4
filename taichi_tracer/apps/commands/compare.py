"""``taichi-tracer compare``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.system.argument_types import percentage

HELP = "how different two pictures are"
run = later("compare:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``compare`` takes."""
    parser.add_argument("first", metavar="A", help="picture: .exr .hdr .pfm .npy .png .jpg; or a checkpoint")
    parser.add_argument("second", metavar="B", help="picture, or checkpoint, of the same size, by which A is measured")
    parser.add_argument("--report", metavar="FILE", help="page to write, .html, with both and where they differ")
    parser.add_argument("--tolerance", type=percentage, metavar="PERCENT", help="exit with 1 if they differ by more")
    parser.add_argument("--data", action="store_true", help="PNG and JPEG hold data, such as normals: not sRGB")
