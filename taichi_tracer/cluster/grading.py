"""A class that workers grade: each submission is sent as its zip file, and what comes back is kept on this machine."""

import io
from argparse import Namespace
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from taichi_tracer.apps import grade as command
from taichi_tracer.apps.words import note
from taichi_tracer.cluster import worker
from taichi_tracer.cluster.jobs import Sweep
from taichi_tracer.cluster.members import Cluster
from taichi_tracer.files.disk import read_bytes
from taichi_tracer.system.errors import IncompleteError, InputError, one_of
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.base import Assignment
from taichi_tracer.teaching.grade import GradingSettings, keep, kept_at, read, with_rules
from taichi_tracer.teaching.marks import Mark, Rules, mark_of
from taichi_tracer.teaching.sandbox import WallLevel
from taichi_tracer.teaching.submissions import Submission

OF_WORKERS = "the strongest of its worker"  # walls, where limits alone are enough


def level_of(trust: bool) -> WallLevel:
    """The walls that every worker has to have; with ``trust``, which of them one has is known there alone."""
    return WallLevel(OF_WORKERS if trust else "bwrap")


def check(assignment: str, found: Sequence[Submission]) -> None:
    """Raise an InputError for what cannot be sent to workers: code of the caller, and folders."""
    if assignment not in catalogue.names():
        known = [*catalogue.names(), "on a cluster, to which no assignment of your own is sent"]
        raise one_of("assignment", assignment, known)
    for one in found:
        if not one.path.is_file():
            raise InputError(f"{one.path}: a cluster grades zip files, and this is a folder: pack it, or grade it here")


def grade_class(
    cluster: Cluster,
    assignment: Assignment,
    found: Sequence[Submission],
    rules: Rules,
    settings: GradingSettings,
    watch: Callable[[Mark], Any] | None = None,
) -> list[Mark]:
    """As ``teaching.grade.grade_class``, on the workers of a cluster.

    What was graded is kept on this machine, so that a class that was interrupted goes on.

    Args:
        settings: its level is that of ``level_of``; how many are graded at the same time, the cluster decides.
    """
    check(assignment.name, found)
    places = [kept_at(assignment, one, settings.seed) for one in found]
    kept = [None if settings.anew else read(place) for place in places]
    marks = {i: with_rules(mark, found[i], rules, assignment) for i, mark in enumerate(kept) if mark is not None}
    for mark in marks.values() if watch is not None else ():
        watch(mark)
    to_do = [i for i in range(len(found)) if i not in marks]
    trust = settings.level.name == OF_WORKERS

    def submit(job: int, member: Any) -> Any:
        """Give a submission to a worker."""
        one = found[to_do[job]]
        words = cluster.session, assignment.name, one.path.name, read_bytes(one.path), settings.seed, trust
        return cluster.submit(worker.grade, *words, at=[member.address])

    def came(job: int, answer: dict) -> None:
        """Keep the mark that a worker gave."""
        i = to_do[job]
        mark = mark_of(answer["facts"])
        with np.load(io.BytesIO(answer["pictures"]), allow_pickle=False) as pictures:
            keep(places[i], mark, dict(pictures))
        marks[i] = with_rules(mark, found[i], rules, assignment)
        if watch is not None:
            watch(marks[i])

    if to_do:
        cluster.prepare("cpu", "f32", False)
        Sweep(cluster, submit, len(to_do)).run(came)
    return [marks[i] for i in range(len(found))]


def run(args: Namespace) -> int:
    """``taichi-tracer grade`` on a cluster."""
    check(args.assignment, [])
    if args.upload:
        raise InputError("--gradescope-upload grades nothing: leave out --cluster")
    with Cluster(args.cluster, note) as cluster:
        try:
            return command.run(args, Graders(cluster, args.assignment))
        except IncompleteError as error:
            raise InputError(f"{error}: what was graded is kept: to go on, run the same command again") from None


class Graders:
    """The workers of a cluster, which grade for ``apps.grade.run``."""

    def __init__(self, cluster: Cluster, assignment: str) -> None:
        self.assignment, self.grade_class = assignment, partial(grade_class, cluster)

    def walls(self, trust: bool, found: Sequence[Submission]) -> WallLevel:
        """The walls in words: each worker has its own, and the report of each student names them."""
        check(self.assignment, found)
        if trust:
            note("workers without bubblewrap grade with limits alone, and the report of each student says so")
        return level_of(trust)
