"""``taichi-tracer assignment``: which assignments there are, and a student's folder of one."""

from argparse import Namespace

from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.handing_out import write_folder, write_notebook


def list_all(args: Namespace) -> int:
    """Print every assignment that comes with the package."""
    for name in catalogue.names():
        assignment = catalogue.load(name)
        print(f"{name:<6}{assignment.title}  ({len(assignment.parts)} parts, {assignment.points:g} points)")
    return 0


def new(args: Namespace) -> int:
    """Write a student's folder, or notebook."""
    write = write_notebook if args.notebook else write_folder
    for path in write(catalogue.load(args.assignment), args.folder, args.solution, args.seed):
        print(path)
    return 0
