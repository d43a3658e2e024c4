"""Which fast form runs, and why: the only place where the two wings of the house meet."""

from dataclasses import dataclass

from taichi_tracer.fast.nearest import FastBruteForce
from taichi_tracer.fast.wide_bvh import WideBVH
from taichi_tracer.system.seams import why_replaced

STAND_INS = {cls.stands_in_for: cls for cls in (WideBVH, FastBruteForce)}


@dataclass(frozen=True)
class Form:
    """Which form of something runs, for receipts.

    Attributes:
        what: "rays", "eye rays", …
        runs: the form. why: the reason. is_fast: whether it stands in for a plain one.
    """

    what: str
    runs: str
    why: str
    is_fast: bool = False

    def __str__(self) -> str:
        return f"{self.what:<15} {self.runs}: {self.why}"


def intersector_class(chosen: type, fast: bool) -> tuple[type, Form]:
    """The class that answers for the one that was chosen, and why it is that one."""
    if chosen not in STAND_INS:
        return chosen, Form("rays", f"{chosen.__name__}, as it is written", "it has no fast form")
    if not fast:
        return chosen, Form("rays", f"{chosen.__name__}, the plain form", "fast=False")
    if why := why_replaced(chosen):
        return chosen, Form("rays", f"{chosen.__name__}, the plain form", why)
    stand_in = STAND_INS[chosen]
    return stand_in, Form("rays", stand_in.form, f"nothing of {chosen.__name__} is replaced", True)
