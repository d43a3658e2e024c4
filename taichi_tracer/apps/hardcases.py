"""``taichi-tracer hardcases``: whether hard cases stay stable on this machine, in every mode."""

import json
import os
import sys
from argparse import Namespace
from pathlib import Path

from tqdm import tqdm

from taichi_tracer.errors import InputError
from taichi_tracer.files.disk import check_place, replace_file
from taichi_tracer.studies import hard_cases
from taichi_tracer.studies.hard import report


def run(args: Namespace) -> int:
    """Print the table and the verdicts; 1 when a mode breaks a promise."""
    if args.json is not None:
        check_place(args.json)
    if args.report is not None:
        check_folder(Path(args.report))
    count = len(hard_cases.all_modes())
    with tqdm(total=count, unit="mode", disable=not sys.stderr.isatty(), leave=False) as bar:

        def progress(what: str) -> None:
            bar.set_description(what)
            bar.update(0 if what.startswith("renderer") else 1)

        result = hard_cases.run(args.level, with_leak_maps=args.report is not None, progress=progress)
    print("\n".join(hard_cases.table(result)))
    if args.json is not None:
        text = json.dumps(hard_cases.as_json(result), indent=1, allow_nan=False)
        replace_file(args.json, text.encode() + b"\n")
        print(f"wrote {args.json}")
    if args.report is not None:
        path = Path(args.report) / "index.html"
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, report.page(result).encode())
        print(f"wrote {path}")
    return 0 if result.passed else 1


def check_folder(path: Path) -> None:
    """Raise an InputError now if a page could not be written into a folder later; it may not exist yet."""
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: this is a file: give a folder")
    there = next(p for p in (path.absolute(), *path.absolute().parents) if p.exists())
    if not there.is_dir():
        raise InputError(f"{path}: {there} is a file, not a folder")
    if not os.access(there, os.W_OK):
        raise InputError(f"{path}: no permission to write in {there}")
    if path.is_dir():
        check_place(path / "index.html")
