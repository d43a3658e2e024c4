"""``taichi-tracer hardcases``: whether hard cases stay stable on this machine, in every mode."""

import json
from argparse import Namespace
from pathlib import Path

from tqdm import tqdm

from taichi_tracer.files.disk import check_place, make_folder, replace_file
from taichi_tracer.studies import hard_cases
from taichi_tracer.studies.hard import report


def run(args: Namespace) -> int:
    """Print the table and the verdicts; 1 when a mode breaks a promise."""
    if args.json is not None:
        check_place(args.json)
    if args.report is not None:
        make_folder(args.report, f"--report {args.report}")
        check_place(Path(args.report) / "index.html")
    count = len(hard_cases.all_modes())
    with tqdm(total=count, unit="mode", disable=None, leave=False) as bar:

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
        replace_file(path, report.page(result).encode())
        print(f"wrote {path}")
    return 0 if result.passed else 1
