"""``taichi-tracer new-part``: a file with a part to begin with, which runs at once."""

from taichi_tracer.apps.grammar import Parser, later

HELP = "write a part of your own to begin with, such as a BRDF or a camera"
run = later("new_part:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``new-part`` takes."""
    kinds = "brdf, light, integrator, view, sampler, camera, triangle_test, intersector, environment, tone"
    parser.add_argument("kind", metavar="KIND", help=kinds)
    parser.add_argument("name", metavar="NAME", help="of the part: letters, digits and _")
    parser.add_argument("-o", "--output", metavar="FILE", default="my_parts.py", help="(default: my_parts.py)")
