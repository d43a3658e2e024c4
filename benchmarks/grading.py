"""How long a class takes to be graded, and how much memory the grader needs.

The class is made of the solution of assignment 1: most students make up to three known mistakes, some of them two in
one method; others have not written a file, have a method that never ends, or hand in a file that is no program.

python -m benchmarks.grading [STUDENTS]
"""

import csv
import os
import random
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

from benchmarks.measure import describe_machine
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.base import Assignment, Mistake
from taichi_tracer.teaching.cutting import solved, stub_of
from taichi_tracer.teaching.mistakes import split_at_method

STUDENTS, ASSIGNMENT, JOBS, SEED = 100, "a1", 2, 1
SAME = 10  # how many are graded again by one job, under other names and so in another order
MOST_MISTAKES, SHARE_OF_PAIRS = 3, 0.2
UNWRITTEN_EVERY, ENDLESS_EVERY, BROKEN_EVERY = 10, 25, 33
ENDS = "        nearest = tt.no_hit()\n"
ENDLESS = "        while nearest.distance > 0:\n            nearest.distance *= 2\n"
FIRST_ID = 123456000
LOOK_EVERY = 0.2  # seconds between two looks at the memory


def with_mistake(assignment: Assignment, texts: dict[str, str], mistake: Mistake) -> bool:
    """Make a mistake in the files of a student; False if another one has removed its place."""
    part = assignment.part(mistake.part)
    file = assignment.classes[part.replaces]
    before, method, after = split_at_method(texts[file], part.replaces, part.method, file)
    if any(method.count(old) != 1 for old, _ in mistake.changes):
        return False
    for old, new in mistake.changes:
        method = method.replace(old, new)
    texts[file] = before + method + after
    return True


def student(assignment: Assignment, number: int, rng: random.Random) -> dict[str, str]:
    """The files of one student."""
    sources = {file: (assignment.solution_folder / file).read_text(encoding="utf-8") for file in assignment.files}
    texts = {file: solved(text, file) for file, text in sources.items()}
    for part in rng.sample([p for p in assignment.parts if p.replaces], rng.randint(0, MOST_MISTAKES)):
        known = assignment.mistakes_of(part)
        for mistake in rng.sample(known, min(len(known), 1 + (rng.random() < SHARE_OF_PAIRS))):
            with_mistake(assignment, texts, mistake)
    if number % UNWRITTEN_EVERY == 1:
        file = rng.choice(assignment.files)
        texts[file] = stub_of(sources[file], file)
    if number % ENDLESS_EVERY == 2:
        texts["ray_intersector.py"] = texts["ray_intersector.py"].replace(ENDS, ENDS + ENDLESS)
    if number % BROKEN_EVERY == 3:
        texts[rng.choice(assignment.files)] = "this is no program\n"
    return texts


def write_class(folder: Path, count: int) -> list[Path]:
    """The zips of a class."""
    assignment, rng = catalogue.load(ASSIGNMENT), random.Random(SEED)
    folder.mkdir()
    paths = []
    for number in range(count):
        path = folder / f"{FIRST_ID + number}.zip"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
            for name, text in student(assignment, number, rng).items():
                file.writestr(name, text)
        paths.append(path)
    return paths


def memory_of(process: int) -> tuple[int, int]:
    """(the largest resident memory so far, the resident memory now) of a process, in bytes."""
    try:
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
    except OSError:
        return 0, 0
    facts = dict(line.split(":", 1) for line in lines if ":" in line)
    return tuple(1024 * int(facts.get(name, "0 kB").split()[0]) for name in ("VmHWM", "VmRSS"))  # type: ignore[return-value]


def descendants(process: int) -> list[int]:
    """A process and all that it has started."""
    found = [process]
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        try:
            children = task.read_text().split()
        except OSError:
            continue
        found += [one for child in children for one in descendants(int(child))]
    return found


def grade(folder: Path, table: Path, jobs: int, *words: str) -> tuple[float, float, int, int]:
    """Grade a folder.

    Returns:
        (seconds of the clock, of the processor in all processes, the grader's largest memory, that of all processes).
    """
    command = [sys.executable, "-m", "taichi_tracer", "grade", ASSIGNMENT, str(folder), "--jobs", str(jobs)]
    start, before, own, together = time.perf_counter(), os.times(), 0, 0
    with subprocess.Popen([*command, "--csv", str(table), *words], stdout=sys.stderr) as process:
        while process.poll() is None:
            own = max(own, memory_of(process.pid)[0])
            together = max(together, sum(memory_of(one)[1] for one in descendants(process.pid)))
            time.sleep(LOOK_EVERY)
    if process.returncode != 0:
        raise SystemExit(f"grade ended with {process.returncode}")
    after = os.times()
    work = sum(getattr(after, name) - getattr(before, name) for name in ("children_user", "children_system"))
    return time.perf_counter() - start, work, own, together


def marks(table: Path) -> dict[str, list[str]]:
    """Student → the points of the parts."""
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    return {row[0]: row[2:] for row in rows[1:]}


def main(count: int) -> None:
    """Grade a class, and ten of it again."""
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work)
        os.environ["TAICHI_TRACER_CACHE"] = str(folder / "cache")
        paths = write_class(folder / "class", count)
        before = os.getloadavg()[0]
        seconds, work, own, together = grade(
            folder / "class", folder / "two.csv", JOBS, "--report", str(folder / "pages")
        )
        after = os.getloadavg()[0]
        again = folder / "again"
        again.mkdir()
        chosen = paths[:: max(1, count // SAME)][:SAME]
        names = {path.stem: str(FIRST_ID + count - k) for k, path in enumerate(chosen)}
        for path in chosen:
            (again / f"{names[path.stem]}.zip").write_bytes(path.read_bytes())
        grade(again, folder / "one.csv", 1, "--anew")
        two, one = marks(folder / "two.csv"), marks(folder / "one.csv")
        same = sum(two[name] == one[other] for name, other in names.items())
    print(describe_machine())
    print(f"load of the machine: {before:.1f} before, {after:.1f} after; {JOBS} jobs\n")
    print("| | |\n|---|--:|")
    print(f"| {count} submissions of {ASSIGNMENT}, nothing kept from before | {seconds / 60:.1f} min |")
    print(f"| each | {seconds / count:.1f} s |")
    print(f"| of the processor, in all processes | {work / 60:.1f} min |")
    print(f"| memory of the grader, at most | {own / 2**20:.0f} MB |")
    print(f"| memory of all its processes together, at most | {together / 2**20:.0f} MB |")
    print(f"| the same points by one job, in another order | {same} of {len(names)} |")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else STUDENTS)
