"""Run every benchmark, each in a process of its own, and write benchmarks/RESULTS.md.

python -m benchmarks.results [NAME ...]     only the named ones are measured again; the other results stay. A name may
                                            have arguments of its own, "paths error", which is a section of its own
python -m benchmarks.results --mark         nothing is measured; results that are older than their code are marked

Without a name, it runs those that measure time, in less than 30 minutes. The others (``COUNTED``) count errors of many
thousand pictures, which takes hours and does not depend on the machine: they run only if they are named, as those that
say something only on a machine with a graphics card (``WITH_A_GPU``).
"""

import datetime
import re
import subprocess
import sys
import time
from pathlib import Path

RESULTS = Path(__file__).parent / "RESULTS.md"
BENCHMARKS = {
    "startup": [],
    "rays": ["82000", "512000"],
    "scaling": [],
    "growth": [],
    "build": ["82000", "1300000"],
    "crossover": [],
    "direct": [],
    "error": [],
    "samplers": ["errors", "compensation"],
    "paths": ["sample", "compile"],
    "surfaces": [],
    "instances": [],
    "obj_reader": [],
    "grading": [],
    "mutants": [],
    "claims": [],
    "cluster": ["--seconds", "30"],
    "live": [],
    "backends": [],
}
WITH_A_GPU = ("backends",)
COUNTED = ("error", "samplers", "mutants", "claims")
# The files and folders of the package whose speed a benchmark measures.
RAYS = ["fast", "ray_intersector.py", "geometry.py"]
SAMPLES = ["integrators", "lights", "brdfs", "sampler.py", "samplers", "environment.py", "progressive.py", "picture"]
LIGHT = [*RAYS, *SAMPLES]
MEASURED = {
    "startup": [
        "system",
        "fast",
        "scene_data.py",
        "scene_data_loader.py",
        "progressive.py",
        "apps/cli.py",
        "apps/commands",
        "apps/render.py",
        "apps/keeping.py",
        "apps/choices.py",
    ],
    "rays": [*RAYS, "scene_data.py"],
    "scaling": RAYS,
    "growth": [*LIGHT, "scene_data.py"],
    "build": ["fast/bvh_build.py", "fast/bvh_wide.py", "fast/wide_bvh.py"],
    "crossover": [*RAYS, "intersectors"],
    "direct": LIGHT,
    "error": ["picture", "integrators", "lights", "sampler.py", "samplers"],
    "samplers": ["sampler.py", "samplers", "integrators", "lights"],
    "paths": LIGHT,
    "surfaces": [*LIGHT, "textures.py"],
    "instances": [*RAYS, "intersectors", "instances.py", "places.py"],
    "obj_reader": ["files/obj.py", "files/text.py"],
    "grading": ["teaching"],
    "mutants": ["teaching"],
    "claims": ["picture", "unseen", "integrators", "lights"],
    "cluster": ["cluster"],
    "live": [
        "apps/session.py",
        "apps/mailbox.py",
        "apps/frames.py",
        "apps/pace.py",
        "apps/server.py",
        "apps/widget.py",
        "apps/live",
    ],
    "backends": [*LIGHT, "system"],
}
ROOT = Path(__file__).parents[1]
WHEN = re.compile(r"\b(\d{4}-\d\d-\d\d)(?: (\d\d:\d\d) UTC)?")
MARK = "> **Older than the code**"
HEAD = """# Results

Each section is the output of the command in its title, with the date, the machine and the versions. Figures are medians
of runs that took turns in one process; only ratios within one section are worth comparing. A section whose code has
changed since then is marked.

"""


def main(names: list[str]) -> int:
    """Run the benchmarks, and write the results. Returns the exit code: 1 if a benchmark failed, 2 for wrong names."""
    old = RESULTS.read_text(encoding="utf-8") if RESULTS.exists() else ""
    parts = dict(re.findall(r"^## `python -m benchmarks\.(.+?)`\n(.*?)(?=^## |\Z)", old, re.MULTILINE | re.DOTALL))
    if names == ["--mark"]:
        write(parts)
        return 0
    if unknown := [name for name in names if name.partition(" ")[0] not in BENCHMARKS]:
        print(f"no benchmark is called {unknown[0]!r}: use some of {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    failed = False
    begin = time.perf_counter()
    for name in names or [name for name in BENCHMARKS if name not in COUNTED + WITH_A_GPU]:
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
    """Write the outputs (name and arguments → text) into RESULTS.md, by benchmark, and mark those that are old."""
    order = {name: k for k, name in enumerate(BENCHMARKS)}
    titles = sorted(parts, key=lambda title: order[title.split()[0]])
    texts = [f"## `python -m benchmarks.{title}`\n\n{marked(title.split()[0], parts[title])}\n" for title in titles]
    RESULTS.write_text(HEAD + "\n".join(texts), encoding="utf-8")


def marked(name: str, text: str) -> str:
    """The output of a benchmark, with a line before it if its code has changed since it was measured."""
    lines = [line for line in text.strip().splitlines() if not line.startswith(MARK)]
    bare = "\n".join(lines).strip()
    measured = measured_at(bare)
    if measured is None:
        return f"{MARK}, perhaps: it has no date.\n\n{bare}"
    paths = [f"benchmarks/{name}.py", *(f"taichi_tracer/{path}" for path in MEASURED[name])]
    newer = [path for path in paths if (changed := changed_at(path)) is not None and changed > measured]
    return f"{MARK}: {', '.join(newer)} changed later.\n\n{bare}" if newer else bare


def measured_at(text: str) -> datetime.datetime | None:
    """The first time that an output names; a day without a time counts from its beginning. None if it names none."""
    found = WHEN.search(text)
    if found is None:
        return None
    return datetime.datetime.fromisoformat(f"{found[1]}T{found[2] or '00:00'}+00:00")


def changed_at(path: str) -> datetime.datetime | None:
    """The minute in which a commit last changed a file, or any file of a folder; None if there is no such commit."""
    command = ["git", "log", "-1", "--format=%cI", "--", path]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    when = done.stdout.strip()
    return datetime.datetime.fromisoformat(when).replace(second=0) if done.returncode == 0 and when else None


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
