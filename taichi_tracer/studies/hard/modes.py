"""What is tested, every triangle test × precision × fast_math × intersector there is, and what each promises."""

from dataclasses import dataclass, field

import numpy as np

from taichi_tracer.ray_intersector import RayIntersector
from taichi_tracer.system import runtime
from taichi_tracer.system.parts import PARTS, replaced
from taichi_tracer.system.runtime import PRECISIONS

OWN_TEST = "own"  # in place of a triangle test, where the intersector has an ``intersect_triangle`` of its own
PLAIN = "bvh"  # a hierarchy that is built in Python, triangle by triangle
REFERENCE = "brute_force"  # the intersector that all others must equal


@dataclass(frozen=True)
class RayMode:
    """One way to intersect rays.

    Attributes:
        triangle_test: its name, or ``OWN_TEST``.
    """

    triangle_test: str
    precision: str
    fast_math: bool
    intersector: str

    @property
    def tries_everything(self) -> bool:
        """Whether each ray is tried against each triangle, so that far fewer rays fit into the same time."""
        intersector = PARTS.find("intersector", self.intersector)
        cls = intersector if isinstance(intersector, type) else type(intersector)
        return cls.search is RayIntersector.search

    def scene_options(self) -> dict:
        """What ``SceneData`` needs to intersect rays in this way."""
        options = {"intersector": self.intersector}
        return options if self.triangle_test == OWN_TEST else options | {"triangle_test": self.triangle_test}

    @property
    def is_watertight(self) -> bool:
        """Whether the mode promises that no ray passes between two triangles."""
        return self.triangle_test not in ZERO

    @property
    def epsilon(self) -> float:
        """The distance from 1 to the next number in the precision."""
        return float(np.finfo(np.float64 if self.precision == "f64" else np.float32).eps)

    def __str__(self) -> str:
        rest = " fast_math" * self.fast_math
        return f"{self.triangle_test} {self.precision} {self.intersector}{rest}"


DEFAULT = RayMode("watertight", "f32", False, "wide_bvh")  # what runs if nobody chooses and the scene is large


def all_modes(with_plain: bool = False) -> list[RayMode]:
    """Every mode, those of one start of Taichi together, and brute force first: the others must equal it.

    Args:
        with_plain: whether the hierarchy to be read is tried too, whose tree takes long to build.
    """
    known = [part for part in PARTS.all("intersector") if with_plain or part.name != PLAIN]
    intersectors = sorted(known, key=lambda part: part.name != REFERENCE)
    tests = PARTS.names("triangle test")
    own = [part.name for part in intersectors if has_own_test(part)]
    ways = [(test, part.name) for test in tests for part in intersectors if part.name not in own]
    ways += [(OWN_TEST, name) for name in own]
    return [
        RayMode(test, precision, fast_math, intersector)
        for fast_math in (False, True)
        for precision in PRECISIONS
        for test, intersector in ways
    ]


def has_own_test(intersector: type[RayIntersector]) -> bool:
    """Whether an intersector decides by itself what a hit on a triangle is, so that no triangle test is asked."""
    return "intersect_triangle" in replaced(intersector)


# Counts that a case may find. None of them is measured against a tolerance that a mode could choose.
COUNTS = {
    "edge_leaks": "rays at an edge that pass through a closed surface",
    "vertex_leaks": "rays at a vertex that pass through a closed surface",
    "misses": "rays at the inside of a triangle that do not hit it",
    "false_hits": "hits whose ray passes the triangle by more than rounding explains",
    "self_hits": "rays that leave a triangle and hit it again",
    "nan": "answers that are not numbers",
    "wrong": "answers that are wrong in another way: the triangle, the side, the window of t",
    "differs": "answers that are not those of brute force, bit for bit",
    "slow": "illegal rays that take more than 2.5 times as long as others",
}


@dataclass(frozen=True)
class Promise:
    """What a mode keeps in every case; what is not named here is reported, and never a failure.

    Attributes:
        zero: counts that are 0.
        t_error: class of rays → largest relative error of t, in ε of the precision.
    """

    zero: frozenset[str] = frozenset()
    t_error: dict[str, float] = field(default_factory=dict)

    def limit(self, finding: str, epsilon: float) -> float | None:
        """The largest value of a finding that is as promised; None where nothing is promised of it."""
        return 0.0 if finding in self.zero else self.t_error[finding] * epsilon if finding in self.t_error else None


# In f32, t is computed once more in f64 at a hit. In f64 there is nothing wider to turn to, nor in f32 on a backend
# without f64: a sliver's aspect, or one over the angle of a grazing ray, multiplies the rounding of the vertices'
# differences.
T_ERROR = {"t_unit": 4, "t_sliver": 4, "t_grazing": 4, "t_far": 4}
T_ERROR_NOT_WIDENED = {"t_unit": 32, "t_sliver": 1e6, "t_grazing": 1e6, "t_far": 64}
ZERO = {"moller_trumbore": frozenset({"nan", "wrong", "differs", "slow"})}
EVERYTHING = frozenset(COUNTS)
# Without f64, the sign of an edge function is unknown where both of its products round to the same number.
NEED_F64 = frozenset({"edge_leaks", "vertex_leaks", "false_hits"})
WITH_FAST_MATH = Promise()  # the compiler may assume that there is no NaN and no rounding: nothing can be promised


def promise_of(mode: RayMode) -> Promise:
    """What a mode promises on the backend that runs. A triangle test without a line in ``ZERO`` must never be wrong."""
    if mode.fast_math:
        return WITH_FAST_MATH
    zero = ZERO.get(mode.triangle_test, EVERYTHING)
    if not runtime.has_f64():
        zero -= NEED_F64
    if not mode.is_watertight and not runtime.can("separate roundings"):
        zero -= {"wrong"}  # a product and a sum with one rounding: u may be below 0 on an edge
    return Promise(zero, T_ERROR if runtime.can_widen() else T_ERROR_NOT_WIDENED)
