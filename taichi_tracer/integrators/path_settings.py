"""How long paths are, and which of their bounces count. The numbers can be changed at any time without compiling."""

from collections.abc import Sequence
from typing import Any

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.integrators.base import Control, LiveNumbers
from taichi_tracer.settings import PATHS, name_of_bounces, usual_values
from taichi_tracer.system.compile_time import inside_kernel
from taichi_tracer.system.errors import InputError

MOST_BOUNCES = 64  # A4-2
ROULETTES = ("course", "throughput")
# With "throughput", a path survives with at most this probability, so that no path lasts for ever (PBR, 4th edition,
# section 14.2.1, and Mitsuba 3 use the same cap).
MOST_SURVIVAL = 0.95
MOST_SLIDER_Q = 0.95  # the right end of the slider; 1 would end every path
DEFAULTS: dict[str, Any] = usual_values(PATHS) | {"bounces": None}

Bounces = tuple[int, int | None]  # (first, last); None: no end


@ti.data_oriented
class PathSettings:
    """The length of paths.

    Attributes:
        max_bounces: how many surfaces may reflect, from 0 to 64: 0 shows only what emits, 1 is direct light (A4-2).
        rr_start_bounce: after this many bounces, Russian roulette may end a path.
        rr_termination_probability: q, with which it ends after each further bounce; a path that goes on is weighted by
            1/(1 − q), so that the mean does not change. 0 is no roulette.
        roulette: "course" takes the constant q; "throughput" takes 1 − the largest component of the throughput, so that
            dark paths end first.
        bounces: (first, last): only light after so many bounces counts; (first, None) counts the light after ``first``
            bounces and more; None counts all (A4-5).
        version: counts the changes.
    """

    def __init__(self) -> None:
        self._values, self._numbers, self.version = dict(DEFAULTS), LiveNumbers(), 0
        self.prepare()

    def prepare(self) -> None:
        """Give kernels the values."""
        of = self._values
        first, last = of["bounces"] or (0, None)
        last = MOST_BOUNCES if last is None else last
        most = min(of["max_bounces"], last)  # a path need not go on after the last bounce that counts
        q = of["rr_termination_probability"]
        self._numbers.set(most, of["rr_start_bounce"], q, of["roulette"] == "throughput", first, last)

    def facts(self) -> dict:
        """Everything that the bits of a picture depend on, for checkpoints."""
        return dict(self._values)

    def set(self, **values) -> None:
        """Change some of the attributes.

        Raises:
            InputError: a value is out of its range; then nothing has changed.
        """
        changed = self._values | values
        check(**changed)
        if changed["bounces"] is not None:
            changed["bounces"] = tuple(changed["bounces"])
        if changed != self._values:
            self._values = changed
            self.version += 1
            self.prepare()

    def receipt(self) -> list[str]:
        """Lines about the bounces and the roulette."""
        of = self._values
        by = {"course": f"with q = {of['rr_termination_probability']:g}", "throughput": "by the throughput"}
        roulette = f"simulated, {by[of['roulette']]} after bounce {of['rr_start_bounce']}"
        if of["roulette"] == "course" and of["rr_termination_probability"] == 0:
            roulette = "not simulated, rr_termination_probability is 0"
        return [f"{'path length':<15} at most {of['max_bounces']} bounces", f"{'roulette':<15} {roulette}"]

    def __getitem__(self, name: str) -> Any:
        if not inside_kernel():
            return self._values[name]
        number = self._numbers.get(list(DEFAULTS).index(name))
        return ti.cast(number, ti.i32) if isinstance(DEFAULTS[name], int) else number

    def controls(self) -> tuple[Control, ...]:
        """What a window can change of these settings, and what has an effect: see ``Integrator.controls``."""
        of, bounces = self._values, self._values["bounces"]
        shown = "all" if bounces is None else str(bounces[0])
        found = [
            Control("max_bounces", of["max_bounces"], 0, MOST_BOUNCES),
            Control("bounces", shown, names=["all", *map(str, range(of["max_bounces"] + 1))]),
            Control("roulette", of["roulette"], names=ROULETTES),
            Control("rr_start_bounce", of["rr_start_bounce"], 0, MOST_BOUNCES),
        ]
        if of["roulette"] == "course":
            found.append(Control("rr_termination_probability", of["rr_termination_probability"], 0.0, MOST_SLIDER_Q))
        return tuple(found)

    # ── in kernels ──

    @ti.func
    def max_bounces(self):
        """How many surfaces of a path may reflect; in kernels."""
        return ti.cast(self._numbers.get(0), ti.i32)

    @ti.func
    def survival(self, depth, throughput):
        """The probability with which a path goes on after its ``depth``-th bounce."""
        q = 0.0
        if depth > self._numbers.get(1):
            q = self._numbers.get(2)
            if self._numbers.get(3) > 0:
                q = 1 - ti.min(tm.component_max(throughput), MOST_SURVIVAL)
        return 1 - q

    @ti.func
    def counts(self, depth):
        """1 if light after ``depth`` bounces counts, otherwise 0."""
        return ti.select(self._numbers.get(4) <= depth and depth <= self._numbers.get(5), 1.0, 0.0)


def check(max_bounces, rr_start_bounce, rr_termination_probability, roulette, bounces) -> None:
    """Raise an InputError for a value that is out of its range."""
    for name, number in (("max_bounces", max_bounces), ("rr_start_bounce", rr_start_bounce)):
        if not isinstance(number, int) or not 0 <= number <= MOST_BOUNCES:
            raise InputError(f"{name} must be a whole number from 0 to {MOST_BOUNCES}, not {number!r}")
    if not isinstance(rr_termination_probability, int | float) or not 0 <= rr_termination_probability < 1:
        raise InputError(
            f"rr_termination_probability must be at least 0 and less than 1, not {rr_termination_probability!r}"
        )
    if roulette not in ROULETTES:
        raise InputError(f"unknown roulette {roulette!r}: use one of {', '.join(ROULETTES)}")
    if bounces is not None:
        check_bounces(bounces)


def check_bounces(bounces) -> None:
    """Raise an InputError if this is not (first, last) or (first, None)."""
    first, last = bounces if isinstance(bounces, tuple | list) and len(bounces) == 2 else (None, None)
    end = MOST_BOUNCES if last is None else last
    if not isinstance(first, int) or not isinstance(end, int) or not 0 <= first <= end <= MOST_BOUNCES:
        text = f"(first, last) with 0 <= first <= last <= {MOST_BOUNCES}, (first, None), or None"
        raise InputError(f"bounces must be {text}, not {bounces!r}")


def check_terms(terms: Sequence[Bounces], max_bounces: int) -> None:
    """Raise an InputError unless the terms can be added up: no bounce twice, and none that no path makes."""
    owners: dict[int, str] = {}
    for term in terms:
        check_bounces(term)
        first, last = term
        name = name_of_bounces((first, last))
        if first > max_bounces:
            raise InputError(f"bounces {name}: paths make at most {max_bounces} bounces: give a larger max_bounces")
        for bounce in range(first, (max_bounces if last is None else last) + 1):
            if bounce in owners:
                raise InputError(f"bounces {owners[bounce]} and {name} both count {bounce}: name each number once")
            owners[bounce] = name
