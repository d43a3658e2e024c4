"""Run every benchmark, each in a process of its own, and write benchmarks/RESULTS.md.

python -m benchmarks [NAME ...]     only the named ones are measured again; the other results stay
"""

import re
import subprocess
import sys
import time
from pathlib import Path

RESULTS = Path(__file__).parent / "RESULTS.md"
BENCHMARKS = ("start", "rays", "build", "frames", "light", "paths", "cluster")
COUNTED = ("claims",)  # counts errors of thousands of pictures, which takes hours: runs only if it is named
HEAD = """# Results

Each section is the output of the command in its title, with the date, the machine and the versions. Figures are medians
of runs that took turns in one process; only ratios within one section are worth comparing.
"""


def main(names: list[str]) -> int:
    """Run the benchmarks, and write the results. Returns the exit code: 1 if a benchmark failed, 2 for wrong names."""
    every = (*BENCHMARKS, *COUNTED)
    if unknown := [name for name in names if name not in every]:
        print(f"no benchmark is called {unknown[0]!r}: use some of {', '.join(every)}", file=sys.stderr)
        return 2
    old = RESULTS.read_text(encoding="utf-8") if RESULTS.exists() else ""
    parts = dict(re.findall(r"^## `python -m benchmarks\.(\w+)`\n(.*?)(?=^## |\Z)", old, re.MULTILINE | re.DOTALL))
    failed = False
    for name in names or BENCHMARKS:
        start = time.perf_counter()
        done = subprocess.run([sys.executable, "-m", f"benchmarks.{name}"], capture_output=True, text=True)
        if done.returncode != 0:
            lines = done.stderr.strip().splitlines() or [f"it ended with exit code {done.returncode}"]
            print(f"{name} failed: {lines[-1]}", file=sys.stderr)
            failed = True
            continue
        parts[name] = without_messages(done.stdout)
        texts = [f"\n## `python -m benchmarks.{name}`\n\n{parts[name].strip()}\n" for name in every if name in parts]
        RESULTS.write_text(HEAD + "".join(texts), encoding="utf-8")
        print(f"{name}: {time.perf_counter() - start:.0f} s", flush=True)
    return int(failed)


def without_messages(output: str) -> str:
    """The output of a benchmark without the messages of Taichi, and without the coloured ones of Mitsuba."""
    plain = re.sub(r"\x1b\[[1-9].*?\x1b\[0m", "", output, flags=re.DOTALL).replace("\x1b[0m", "")
    lines = "\n".join(line for line in plain.splitlines() if not line.startswith("[Taichi]"))
    return re.sub(r"\n{3,}", "\n\n", lines)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
