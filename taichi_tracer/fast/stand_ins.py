"""Which fast form runs, and why. Only this file connects the plain classes with their fast forms."""

from dataclasses import dataclass

from taichi_tracer.fast.nearest import FastBruteForce
from taichi_tracer.fast.wide_bvh import WideBVH
from taichi_tracer.system.seams import why_replaced

STAND_INS = {cls.stands_in_for: cls for cls in (WideBVH, FastBruteForce)}


@dataclass(frozen=True)
class Form:
    """Which form of a part runs, for receipts.

    Attributes:
        what: "rays" or "eye rays".
        runs: the form. why: the reason. is_fast: whether it stands in for a plain form.
    """

    what: str
    runs: str
    why: str
    is_fast: bool = False

    def __str__(self) -> str:
        return f"{self.what:<15} {self.runs}: {self.why}"


def intersector_class(chosen: type, fast: bool) -> tuple[type, Form]:
    """The class that runs in place of the chosen class (it may be the same), and the reason."""
    if chosen not in STAND_INS:
        return chosen, Form("rays", f"{chosen.__name__}, as it is written", "it has no fast form")
    if not fast:
        return chosen, Form("rays", f"{chosen.__name__}, the plain form", "fast=False")
    if why := why_replaced(chosen):
        return chosen, Form("rays", f"{chosen.__name__}, the plain form", why)
    stand_in = STAND_INS[chosen]
    return stand_in, Form("rays", stand_in.form, f"no method of {chosen.__name__} is replaced", True)
