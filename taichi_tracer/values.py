"""The values of renderers that may change at any time: their names, their defaults and what they mean.

Where a value stands, this is its default: in Python, in the window, and on the command line, whose options have the
same names. ``ProgressiveRenderer.values`` has the present ones. Nothing here imports Taichi.
"""

from typing import Any, NamedTuple

USUAL_LIGHT = "studio"  # the environment of a picture that shows light, in a scene that has none


class Value(NamedTuple):
    """A value of renderers.

    Attributes:
        name: the attribute of the renderer, and the name for ``ProgressiveRenderer.change``.
        owner: for messages, what it belongs to.
        of: the name of the only integrator that it belongs to; "" where it belongs to all that a renderer offers.
    """

    name: str
    default: Any
    what: str
    owner: str
    of: str = ""


PATHS, LOTS = "paths", "mis_one_sample"
MAX_DISTANCE = Value(
    "max_distance", None, "the distance that the view 'distance' shows white", "the view 'distance'", "distance"
)
MAP_OF = Value("of", "path", "the view, estimator or path whose work a map such as 'nodes' shows", "maps of work")
MAX_BOUNCES = Value("max_bounces", 5, "how many surfaces may reflect", PATHS)
RR_START = Value("rr_start_bounce", 3, "after so many, roulette may end a path", PATHS)
RR_PROBABILITY = Value("rr_termination_probability", 0.0, "with which it ends a path", PATHS)
ROULETTE = Value("roulette", "course", "course: the constant Q; throughput: dark paths end first", PATHS)
BOUNCES = Value("bounces", None, "the light after which bounces counts", PATHS)
OF_PATHS = MAX_BOUNCES, RR_START, RR_PROBABILITY, ROULETTE, BOUNCES
WEIGHTS = (
    Value("mis_plight", 0.5, "one to a light", f"the estimator {LOTS!r}", LOTS),
    Value("mis_pbrdf", 0.5, "one from the BRDF", f"the estimator {LOTS!r}", LOTS),
)
VALUES = {value.name: value for value in (MAX_DISTANCE, MAP_OF, *OF_PATHS, *WEIGHTS)}
