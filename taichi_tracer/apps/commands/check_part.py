"""Check your own parts: densities, energy, rays, random numbers; prints the first wrong number."""

import html
import sys
import time
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

from taichi_tracer.apps.faults import text_of_fault
from taichi_tracer.apps.grammar import Parser
from taichi_tracer.files import page
from taichi_tracer.files.disk import check_place, replace_file
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.importing import import_quickly
from taichi_tracer.system.parts.registry import class_name, load_parts

RIGHT, WRONG = 0, 1  # exit codes


def add_arguments(parser: Parser) -> None:
    """Add what ``check-part`` takes."""
    parser.add_argument("file", metavar="FILE", help="with parts, as for --parts")
    parser.add_argument("names", metavar="NAME", nargs="*", help="only these parts (default: all of the file)")
    parser.add_argument("--page", metavar="FILE", help="page with drawings to write (default: that of FILE, .html)")


def run(args: Namespace) -> int:
    """Check the parts of a file. The exit code is 1 if one is wrong."""
    if sys.flags.optimize:
        raise InputError("check-part: python -O leaves out every check: run it without -O")
    parts = chosen(load_parts(args.file), args)
    target = Path(args.page).expanduser() if args.page else Path(args.file).expanduser().with_suffix(".html")
    check_place(target)
    if runtime.current() is None:
        runtime.init("cpu")
    try:
        found = [checked(part) for part in parts]
    except Exception as error:
        text = text_of_fault(error, [args.file])
        if isinstance(error, InputError) or text is None:
            raise
        raise InputError(text) from error
    sections = [section for is_right, sections in found for section in sections]
    replace_file(target, page.page(f"Parts of {Path(args.file).name}", sections).encode())
    print(target)
    return RIGHT if all(is_right for is_right, _ in found) else WRONG


def chosen(parts: list, args: Namespace) -> list:
    """Those of the parts of a file whose names were given; all if none was."""
    known = {part.name: part for part in parts}
    for name in args.names:
        if name not in known:
            raise one_of(f"part of {args.file}", name, known)
    if not parts:
        raise InputError(f"{args.file}: the file registers no part: put @tt.register before each class")
    return [part for name, part in known.items() if not args.names or name in args.names]


def checked(part: Any) -> tuple[bool, list[str]]:
    """Run the checks of a part until one fails, and print them. Returns whether all hold, and its part of the page."""
    kind = "view" if getattr(part, "what", "") == "view" else part.kind
    title = f"{kind} {part.name} ({class_name(part)})"
    print(title)
    steps = import_quickly("taichi_tracer.contracts.steps").steps_of(part)
    lines, is_right = [], True
    for what, check in steps:
        is_right, line = outcome(what, check)
        lines.append(line)
        print(line, flush=True)
        if not is_right:
            break
    if not steps:
        lines.append("  nothing is checked: it describes none of the materials that are tried, or it only joins parts")
        print(lines[-1])
    drawings = import_quickly("taichi_tracer.contracts.plots").plots_of(part) if steps else []
    text = "<br>".join(html.escape(line.strip()) for line in lines)
    return is_right, [f"<h2>{html.escape(title)}</h2><p>{text}</p>", *drawings]


def outcome(what: str, check: Callable[[], object]) -> tuple[bool, str]:
    """Whether a check holds, and the line about it: what was checked, or the first wrong number."""
    start = time.perf_counter()
    try:
        check()
    except AssertionError as error:
        text = " ".join(str(error).split())
        return False, f"  WRONG  {text or what}"
    return True, f"  right  {what} ({time.perf_counter() - start:.1f} s)"
