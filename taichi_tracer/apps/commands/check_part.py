"""``taichi-tracer check-part``: whether the parts of a file do what every part of their kind must do."""

from taichi_tracer.apps.grammar import Parser, later

HELP = "check your own parts: densities, energy, rays, random numbers; prints the first wrong number"
run = later("check_part:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``check-part`` takes."""
    parser.add_argument("file", metavar="FILE", help="with parts, as for --parts")
    parser.add_argument("names", metavar="NAME", nargs="*", help="only these parts (default: all of the file)")
    parser.add_argument("--page", metavar="FILE", help="page with drawings to write (default: that of FILE, .html)")
