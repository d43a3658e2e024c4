"""``taichi-tracer hardcases``: whether hard cases stay stable on this machine, in every mode."""

import json
from argparse import Namespace
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from taichi_tracer.apps.rescue import written_bytes
from taichi_tracer.apps.words import taken
from taichi_tracer.files.disk import check_place, make_folder
from taichi_tracer.studies import hard_cases
from taichi_tracer.studies.hard import report


@dataclass(frozen=True)
class HardCasesRequest:
    """How much is tried, and where it is written beside the terminal; None is nowhere."""

    level: str
    json: str | None
    report: str | None


def run(args: Namespace) -> int:
    """Print the table and the verdicts; 1 when a mode breaks a promise."""
    request = taken(HardCasesRequest, args)
    if request.json is not None:
        check_place(request.json)
    if request.report is not None:
        make_folder(request.report, f"--report {request.report}")
        check_place(Path(request.report) / "index.html")
    count = len(hard_cases.modes_of(request.level))
    with tqdm(total=count, unit="mode", disable=None, leave=False) as bar:

        def progress(what: str) -> None:
            """Bring the bar up to date; the renderer's cases are no mode."""
            bar.set_description(what)
            bar.update(0 if what.startswith("renderer") else 1)

        result = hard_cases.run(request.level, with_leak_maps=request.report is not None, progress=progress)
    print("\n".join(hard_cases.table(result)))
    if request.json is not None:
        text = json.dumps(hard_cases.as_json(result), indent=1, allow_nan=False) + "\n"
        print(f"wrote {written_bytes(Path(request.json), text.encode())}")
    if request.report is not None:
        path = Path(request.report) / "index.html"
        print(f"wrote {written_bytes(path, report.page(result).encode())}")
    return 0 if result.passed else 1
