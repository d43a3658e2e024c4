"""Run every benchmark, each in a process of its own, and write benchmarks/RESULTS.md.

python -m benchmarks.results [NAME ...]     only the named ones are measured again; the other results stay
"""

import re
import subprocess
import sys
from pathlib import Path

RESULTS = Path(__file__).parent / "RESULTS.md"
BENCHMARKS = {
    "startup": [],
    "rays": ["82000", "512000"],
    "scaling": [],
    "build": ["82000", "1300000"],
    "crossover": [],
    "direct": [],
    "error": [],
    "samplers": ["errors"],
    "paths": ["sample", "compile"],
    "obj_reader": [],
    "grading": [],
    "cluster": [],
    "live": [],
}
HEAD = """# Results

Each section is the output of the command in its title, with the date, the machine and the versions. Figures are medians
of runs that took turns in one process; only ratios within one section are worth comparing.

"""


def main(names: list[str]) -> None:
    """Run the benchmarks, and write the results."""
    old = RESULTS.read_text(encoding="utf-8") if RESULTS.exists() else ""
    parts = dict(re.findall(r"^## `python -m benchmarks\.(\w+).*?`\n(.*?)(?=^## |\Z)", old, re.MULTILINE | re.DOTALL))
    for name in names or BENCHMARKS:
        command = [sys.executable, "-m", f"benchmarks.{name}", *BENCHMARKS[name]]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            print(f"{name} failed: {done.stderr.strip().splitlines()[-1]}", file=sys.stderr)
            continue
        lines = [line for line in done.stdout.splitlines() if not line.startswith(("[Taichi]", "\x1b["))]
        parts[name] = "\n" + "\n".join(lines).strip() + "\n\n"
        write(parts)
        print(f"{name}: done", flush=True)


def write(parts: dict[str, str]) -> None:
    """Write the outputs (name → text) into RESULTS.md, in the order of ``BENCHMARKS``."""
    titles = {name: " ".join([f"python -m benchmarks.{name}", *BENCHMARKS[name]]) for name in BENCHMARKS}
    text = "\n".join(f"## `{titles[name]}`\n\n{parts[name].strip()}\n" for name in BENCHMARKS if name in parts)
    RESULTS.write_text(HEAD + text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
