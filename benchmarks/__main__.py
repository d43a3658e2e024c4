"""Run every benchmark, each in a process of its own, and write benchmarks/RESULTS.md.

python -m benchmarks [NAME ...]     only the named ones are measured again; the other results stay. A name may have
                                    arguments of its own, "paths error", which is a section of its own

Without a name, it runs those that measure time, in less than 30 minutes. The others (``COUNTED``) count errors of many
thousand pictures, which takes hours and does not depend on the machine: they run only if they are named.
"""

import re
import subprocess
import sys
import time
from pathlib import Path

RESULTS = Path(__file__).parent / "RESULTS.md"
BENCHMARKS = {
    "startup": [],
    "rays": ["82000", "512000"],
    "build": ["82000", "1300000"],
    "frames": [],
    "direct": [],
    "error": [],
    "paths": [],
    "claims": [],
    "cluster": ["--seconds", "30"],
}
COUNTED = ("error", "claims")
HEAD = """# Results

Each section is the output of the command in its title, with the date, the machine and the versions. Figures are medians
of runs that took turns in one process; only ratios within one section are worth comparing.

"""


def main(names: list[str]) -> int:
    """Run the benchmarks, and write the results. Returns the exit code: 1 if a benchmark failed, 2 for wrong names."""
    old = RESULTS.read_text(encoding="utf-8") if RESULTS.exists() else ""
    parts = dict(re.findall(r"^## `python -m benchmarks\.(.+?)`\n(.*?)(?=^## |\Z)", old, re.MULTILINE | re.DOTALL))
    if unknown := [name for name in names if name.partition(" ")[0] not in BENCHMARKS]:
        print(f"no benchmark is called {unknown[0]!r}: use some of {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    failed = False
    begin = time.perf_counter()
    for name in names or [name for name in BENCHMARKS if name not in COUNTED]:
        start = time.perf_counter()
        words = name.split() if name not in BENCHMARKS else [name, *BENCHMARKS[name]]
        command = [sys.executable, "-m", f"benchmarks.{words[0]}", *words[1:]]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            lines = done.stderr.strip().splitlines() or [f"it ended with exit code {done.returncode}"]
            print(f"{name} failed: {lines[-1]}", file=sys.stderr)
            failed = True
            continue
        parts[" ".join(words)] = f"\n{without_messages(done.stdout)}\n\n"
        write(parts)
        print(f"{name}: {time.perf_counter() - start:.0f} s", flush=True)
    print(f"all: {(time.perf_counter() - begin) / 60:.1f} minutes")
    return int(failed)


def without_messages(output: str) -> str:
    """The output of a benchmark without the messages of Taichi, and without the coloured ones of Mitsuba."""
    plain = re.sub(r"\x1b\[[1-9].*?\x1b\[0m", "", output, flags=re.DOTALL).replace("\x1b[0m", "")
    return "\n".join(line for line in plain.splitlines() if not line.startswith("[Taichi]")).strip()


def write(parts: dict[str, str]) -> None:
    """Write the outputs (name and arguments → text) into RESULTS.md, by benchmark."""
    order = {name: k for k, name in enumerate(BENCHMARKS)}
    titles = sorted(parts, key=lambda title: order[title.split()[0]])
    texts = [f"## `python -m benchmarks.{title}`\n\n{parts[title].strip()}\n" for title in titles]
    RESULTS.write_text(HEAD + "\n".join(texts), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
