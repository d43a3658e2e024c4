"""Check your own parts: densities, energy, rays, random numbers; prints the first wrong number."""

import sys
import time
from argparse import Namespace
from typing import Any

from taichi_tracer.apps.console import Parser
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.importing import import_quickly
from taichi_tracer.system.parts import PARTS, class_name

RIGHT, WRONG = 0, 1  # exit codes


def add_arguments(parser: Parser) -> None:
    """Add what ``check-part`` takes."""
    parser.add_argument("parts", metavar="FILE", nargs=1, help="with parts, as for --parts")
    parser.add_argument("names", metavar="NAME", nargs="*", help="only these parts (default: all of the file)")


def run(args: Namespace) -> int:
    """Check the parts of a file. The exit code is 1 if one is wrong."""
    if sys.flags.optimize:
        raise InputError("check-part: python -O leaves out every check: run it without -O")
    (file,) = args.parts
    known = {part.name: part for part in PARTS.registered_by(file)}
    for name in args.names:
        if name not in known:
            raise one_of(f"part of {file}", name, known)
    if not known:
        raise InputError(f"{file}: the file registers no part: put @tt.register before each class")
    if runtime.current() is None:
        runtime.init("cpu")
    found = [checked(known[name]) for name in args.names or known]
    return RIGHT if all(found) else WRONG


def checked(part: Any) -> bool:
    """Run the checks of a part until one fails, and print them. Returns whether all hold."""
    kind = "view" if getattr(part, "what", "") == "view" else part.kind
    print(f"{kind} {part.name} ({class_name(part)})")
    steps = import_quickly("taichi_tracer.contracts.steps").steps_of(part)
    for what, check in steps:
        start = time.perf_counter()
        try:
            check()
        except AssertionError as error:
            print(f"  WRONG  {' '.join(str(error).split()) or what}", flush=True)
            return False
        print(f"  right  {what} ({time.perf_counter() - start:.1f} s)", flush=True)
    if not steps:
        print("  nothing is checked: it describes none of the materials that are tried, or it only joins parts")
    return True
