"""``taichi-tracer doctor``: it has no arguments."""

from taichi_tracer.apps.grammar import Parser, later

HELP = "what works on this machine, and what would mend the rest"
run = later("doctor:run")


def add_arguments(parser: Parser) -> None:
    """Add nothing: ``doctor`` takes no arguments."""
