"""Gradescope: its results.json, and the zip file that makes an autograder of an assignment.

Gradescope unpacks the upload into /autograder/source and runs setup.sh once. For each submission, it runs
/autograder/run_autograder, which reads /autograder/submission and writes /autograder/results/results.json.
"""

import importlib.metadata
import json
import shlex
import shutil
import tempfile
from pathlib import Path

from taichi_tracer.files.disk import check_place, replace_file, scene_data_dir
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.base import RIGHT, Assignment, PartResult
from taichi_tracer.teaching.grading.grade import Mark
from taichi_tracer.teaching.grading.isolate import PACKAGE
from taichi_tracer.teaching.html_boxes import lines_of

SCHEMA = {"visibility": "visible", "stdout_visibility": "hidden"}

SETUP = """#!/usr/bin/env bash
# Gradescope runs this once, as root, when the image of the autograder is made.
set -e
apt-get update
apt-get install -y --no-install-recommends python3 python3-pip libgl1 libgomp1 bubblewrap || \\
    apt-get install -y --no-install-recommends python3 python3-pip libgl1 libgomp1
python3 -m pip install --break-system-packages {packages} || python3 -m pip install {packages}
cd /autograder/source
# The solution's compiled kernels are kept in the image, so that each submission takes seconds.
export PYTHONPATH=/autograder/source TAICHI_TRACER_CACHE=/autograder/source/cache
python3 -m taichi_tracer grade {assignment} {solution} --seed {seed} --trust > /dev/null || true
"""

RUN = """#!/usr/bin/env bash
# Gradescope runs this for each submission, in a container for one student: with --trust, it is graded even if the
# container refuses namespaces to bubblewrap. AUTOGRADER is another folder than /autograder in tests.
root="${{AUTOGRADER:-/autograder}}"
export PYTHONPATH="$root/source" TAICHI_TRACER_CACHE="$root/source/cache"
cd "$root/source"
mkdir -p "$root/results"
"${{PYTHON:-python3}}" -m taichi_tracer grade {assignment} "$root/submission" --seed {seed} --trust \\
    --gradescope "$root/results/results.json" > "$root/results/grader.log" 2>&1
code=$?
if [ $code -ne 0 ]; then
    "${{PYTHON:-python3}}" - "$root/results" <<'PYTHON'
import json, sys
folder = sys.argv[1]
with open(f"{{folder}}/grader.log", errors="replace") as log:
    output = log.read()[-2000:]
output = f"The submission could not be graded; please tell your teacher.\\n\\n{{output}}"
with open(f"{{folder}}/results.json", "w") as results:
    facts = {{"score": 0, "output": output, "visibility": "visible", "stdout_visibility": "hidden", "tests": []}}
    json.dump(facts, results)
PYTHON
fi
"""


# ── results.json ──


def results(mark: Mark) -> str:
    """The text of results.json for one submission. Gradescope itself takes off what is late."""
    tests = [test(number, part) for number, part in enumerate(mark.parts, start=1)]
    facts = {"score": mark.score, "execution_time": round(mark.seconds, 1), "output": "\n".join(mark.remarks)}
    return json.dumps({**facts, **SCHEMA, "tests": tests}, indent=1, allow_nan=False)


def test(number: int, part: PartResult) -> dict:
    """One part as a test of Gradescope."""
    return {
        "name": part.name,
        "number": str(number),
        "score": part.earned,
        "max_score": part.points,
        "status": "passed" if part.status == RIGHT else "failed",
        "output": "\n\n".join([f"**{part.status}**", *(escaped(line.strip()) for line in lines_of(part)[1:])]),
        "output_format": "md",
        "tags": [part.topic],
        "visibility": "visible",
    }


def escaped(text: str) -> str:
    """Text in which Markdown and HTML mean nothing: a part of it may come from the submission."""
    marks = "\\`*_{}[]()#+!|~"
    shown = "".join(f"\\{c}" if c in marks else c for c in text)
    return shown.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


# ── the upload ──


def write_upload(assignment: Assignment, name: str, target: Path, seed: int) -> Path:
    """Write the zip file that a teacher gives to Gradescope.

    Args:
        name: how the assignment was named: a name that the package knows, or a folder, which is put into the file.
    """
    check_place(target, ending=".zip")
    is_shipped = name in catalogue.names()
    called = assignment.name if is_shipped else f"./assignment/{assignment.name}"
    folder = f"taichi_tracer/teaching/assignments/{assignment.name}" if is_shipped else called
    required = importlib.metadata.requires("taichi_tracer") or []
    words = {
        "assignment": shlex.quote(called),
        "solution": shlex.quote(f"{folder}/solution"),
        "seed": seed,
        "packages": shlex.join(package for package in required if "extra ==" not in package),
    }
    unwanted = shutil.ignore_patterns("__pycache__")
    with tempfile.TemporaryDirectory() as work:
        source = Path(work) / "source"
        shutil.copytree(PACKAGE, source / "taichi_tracer", ignore=unwanted)
        data = source / "taichi_tracer" / "scene_data_dir"
        shutil.copytree(scene_data_dir(), data, ignore=unwanted, dirs_exist_ok=True)
        if not is_shipped:
            shutil.copytree(assignment.folder, source / "assignment" / assignment.name, ignore=unwanted)
        for script, text in {"setup.sh": SETUP, "run_autograder": RUN}.items():
            (source / script).write_text(text.format(**words), encoding="utf-8")
            (source / script).chmod(0o755)
        content = Path(shutil.make_archive(f"{work}/upload", "zip", source)).read_bytes()
    replace_file(target, content)
    return target
