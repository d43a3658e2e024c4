"""``taichi-tracer warm-up``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.apps.words import at_least_one, size

HELP = "compile what pictures need, so that the next ones of this kind begin at once"
run = later("warm_up:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``warm-up`` takes."""
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--for",
        dest="scenes",
        nargs="+",
        metavar="SCENE",
        help="pictures of these scenes, names or files: the view normal, and every estimator and path",
    )
    which.add_argument("--assignments", action="store_true", help="what the demos of a1, a2, a3 and a4 show (default)")
    which.add_argument("--all", action="store_true", help="the same pictures as --for, of every shipped scene")
    parser.add_argument(
        "--size", type=size, action="append", metavar="WxH", help="of the pictures; may be given several times"
    )
    parser.add_argument(
        "--jobs", type=at_least_one, metavar="N", help="pictures at the same time (default: one per CPU)"
    )
