"""Which known mistakes are compared with a wrong answer first: running all of them takes longer than a student waits.

A sketch has what each known mistake answers to a few of the inputs, for the seed that folders have. It lies beside the
mistakes. It only decides about the order: a mistake is named because its answers to all inputs are the student's.
"""

import hashlib
import io
from collections.abc import Callable, Sequence

import numpy as np

from taichi_tracer.files.disk import replace_file
from taichi_tracer.teaching.base import Arrays, Assignment, Mistake, Part
from taichi_tracer.teaching.judges import agree
from taichi_tracer.teaching.kept import arrays_in, joined, parted

FILE = "sketches.npz"
SEED = 0  # of the folders that ``assignment new`` writes
ROWS = 5  # inputs of a part
DIGITS = 6  # after the point, of the inputs in a digest
INPUTS, CHANGES = "inputs of the part", "changes of the mistakes"


def likely_first(
    assignment: Assignment, part: Part, inputs: Arrays, answers: Arrays, known: Sequence[Mistake]
) -> list[Mistake]:
    """The known mistakes of a part: those first whose answers to the inputs of the sketch are the student's.

    Without a sketch for these inputs, the order stays.
    """
    found = parted(arrays_in(assignment.folder / FILE) or {}).get(part.name, {})
    if str(found.pop(INPUTS, "")) != digest(inputs):
        return list(known)
    changes = list(found.pop(CHANGES))
    rows = found.pop("rows")
    yours = {name: np.atleast_1d(answers[name]) for name in found if name in answers}
    yours = {name: array[rows] for name, array in yours.items() if len(array) > max(rows)}
    if yours.keys() != found.keys():
        return list(known)

    def score(one: Mistake) -> int:
        if digest_of(one) not in changes:
            return 0
        at = changes.index(digest_of(one))
        return int(agree(part.judge, inputs, yours, {name: every[at] for name, every in found.items()}).sum())

    return sorted(known, key=score, reverse=True)


def write(assignment: Assignment, answers_of: Callable[[Part, Mistake, Arrays], Arrays | None]) -> None:
    """Write the sketch of an assignment.

    Args:
        answers_of: (part, mistake, inputs) → what the solution with this mistake answers; None if it does not run.
    """
    groups = {}
    for part in assignment.parts:
        inputs = assignment.inputs(part, SEED)
        told = {one: answers_of(part, one, inputs) for one in assignment.mistakes_of(part)}
        wrong = {one: found for one, found in told.items() if found is not None}
        if wrong:
            rows = telling_rows(part, inputs, list(wrong.values()))
            names = next(iter(wrong.values())).keys()
            group = {name: np.stack([small(found[name][rows]) for found in wrong.values()]) for name in names}
            facts = {"rows": np.array(rows), CHANGES: np.array([digest_of(one) for one in wrong])}
            groups[part.name] = group | facts | {INPUTS: np.array(digest(inputs))}
    file = io.BytesIO()
    np.savez_compressed(file, **joined(groups))  # type: ignore[arg-type]
    replace_file(assignment.folder / FILE, file.getvalue())


def telling_rows(part: Part, inputs: Arrays, wrong: Sequence[Arrays]) -> list[int]:
    """Inputs to which many mistakes give different answers: each one tells most of the pairs apart that are left."""
    pairs = [(a, b) for i, a in enumerate(wrong) for b in wrong[:i]]
    if not pairs:
        return [0]
    differs = np.array([~agree(part.judge, inputs, a, b) for a, b in pairs])
    rows, is_left = [], np.ones(len(pairs), bool)
    for _ in range(min(ROWS, differs.shape[1])):
        row = int(differs[is_left].sum(axis=0).argmax()) if is_left.any() else int(differs.sum(axis=0).argmax())
        if row in rows:
            break
        rows.append(row)
        is_left &= ~differs[:, row]
    return rows


def small(array: np.ndarray) -> np.ndarray:
    """The array with 32 bits for each number."""
    return array.astype(np.float32) if array.dtype == np.float64 else array


def digest(inputs: Arrays) -> str:
    """A number of the inputs, in short; their last bits depend on the processor, and do not count."""
    found = hashlib.sha256()
    for name in sorted(inputs):
        array = np.asarray(inputs[name])
        if array.dtype.kind == "f":
            array = np.round(array.astype(np.float64), DIGITS) + 0.0  # −0 becomes 0
        found.update(name.encode() + np.ascontiguousarray(array).tobytes())
    return found.hexdigest()[:12]


def digest_of(mistake: Mistake) -> str:
    """A number of what a mistake changes, in short."""
    return hashlib.sha256(repr(mistake.changes).encode()).hexdigest()[:8]
