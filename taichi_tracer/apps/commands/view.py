"""Open the interactive window.

``--browser`` serves the picture to a browser instead.
"""

import sys
from argparse import Namespace

from taichi_tracer.apps.console import Parser
from taichi_tracer.apps.page.server import serve
from taichi_tracer.apps.page.session import Session
from taichi_tracer.apps.pictures import first_renderer
from taichi_tracer.apps.viewer import show
from taichi_tracer.settings import DISPLAY, OF_PICTURE, OF_SCENE, RenderSettings, add_scene
from taichi_tracer.system.argument_types import whole


def add_arguments(parser: Parser) -> None:
    """Add what ``view`` takes."""
    add_scene(parser, *OF_SCENE, *OF_PICTURE, DISPLAY)
    parser.add_argument("--browser", action="store_true", help="serve the picture to a browser on this machine instead")
    parser.add_argument(
        "--forwarded",
        type=whole,
        action="append",
        default=[],
        metavar="PORT",
        help="with --browser: a port of another machine that leads here, if its number is another one",
    )


def run(args: Namespace) -> int:
    """The window of the renderer that offers the view asked for."""
    settings = RenderSettings.of(args)
    renderer = first_renderer(settings, begins_lit=args.browser)
    if args.browser:
        return serve(Session(renderer, settings), args.forwarded)
    return show(renderer, settings=settings, offers_browser=sys.stdout.isatty(), all_views=settings.view is None)
