"""Whether hard cases stay numerically stable, and what that costs."""

from argparse import Namespace
from pathlib import Path

from taichi_tracer.apps.console import Parser
from taichi_tracer.settings import ADVICE, add_options


def add_arguments(parser: Parser) -> None:
    """Add what ``hardcases`` takes."""
    size_of = parser.add_mutually_exclusive_group()
    parser.set_defaults(level="default")
    for name, what in (("quick", "within a minute"), ("full", "for an hour, with 1e8 rays at edges for every mode")):
        size_of.add_argument(f"--{name}", dest="level", action="store_const", const=name, help=what)
    parser.add_argument("--json", metavar="FILE", help="write what was found as JSON, too")
    parser.add_argument("--report", metavar="DIR", help="write a page into a folder, too")
    parser.add_argument("--arch", metavar="NAME", default="auto", help="which backend runs the kernels")
    add_options(parser, ADVICE)


def run(args: Namespace) -> int:
    """Print the table and the verdicts; 1 when a mode breaks a promise."""
    import json

    from tqdm import tqdm

    from taichi_tracer.apps.running import written_bytes
    from taichi_tracer.files.disk import check_place, make_folder
    from taichi_tracer.studies import hard_cases

    check_place(args.json, ending=".json")
    if args.report is not None:
        make_folder(args.report, f"--report {args.report}")
    count = len(hard_cases.modes_of(args.level, args.arch))
    with tqdm(total=count, unit="mode", disable=None, leave=False) as bar:

        def progress(what: str) -> None:
            """Bring the bar up to date; the renderer's cases are no mode."""
            bar.set_description(what)
            bar.update(0 if what.startswith("renderer") else 1)

        result = hard_cases.run(args.level, progress=progress, arch=args.arch)
    print("\n".join(hard_cases.table(result)))
    if args.json is not None:
        text = json.dumps(hard_cases.as_json(result), indent=1, allow_nan=False) + "\n"
        print(f"wrote {written_bytes(Path(args.json), text.encode())}")
    if args.report is not None:
        print(f"wrote {written_bytes(Path(args.report, 'index.html'), hard_cases.as_page(result).encode())}")
    return 0 if result.passed else 1
