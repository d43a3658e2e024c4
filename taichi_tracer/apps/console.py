"""What every command of the command line has in common: its parser, lines for the user, and how its module is found.

Nothing here imports Taichi: a command loads what it needs when it runs.
"""

import argparse
import difflib
import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import Any

from taichi_tracer.system.errors import InputError, printable

# ── lines for the user ──


USER_ERROR = 2  # exit code: the input cannot be used, or a file could not be written where it was wanted
PICTURE_FOLDER = "renders"  # where pictures go for which nobody names a place
noted: set[str] = set()  # the notes of the command that runs


def note(text: str) -> None:
    """Print a line on stderr, once: a scene that is read three times says the same three times."""
    text = printable(text)
    if text not in noted:
        noted.add(text)
        print(f"taichi-tracer: note: {text}", file=sys.stderr)


def let_every_character_print() -> None:
    """Where a terminal or a pipe lacks a character, as in ASCII, print its number instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


# ── the grammar of the command line ──


NEGATIVE = re.compile(r"-(\.?\d|inf|nan)", re.IGNORECASE)  # what is a number and no option, as in -1e-3
CLUSTER = "taichi_tracer.cluster.sharing:on_cluster"  # runs a command where --cluster is given


class Parser(argparse.ArgumentParser):
    """An ArgumentParser whose errors are ours, and whose help may end with lists of names."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self._negative_number_matcher = NEGATIVE

    def error(self, message: str) -> None:
        """Raise instead of printing the whole usage; an unknown option gets the most similar one."""
        kinds = [action for action in self._actions if isinstance(action, argparse._SubParsersAction)]
        parsers = [self, *(parser for kind in kinds for parser in kind.choices.values())]
        known = [option for parser in parsers for option in parser._option_string_actions]
        unknown = re.match(r"unrecognized arguments: .*?(--[\w-]+)", message)
        near = difflib.get_close_matches(unknown[1], known, n=1) if unknown else []
        guess = f": did you mean {near[0]}?" if near else ""
        raise InputError(f"{message}{guess} (see: {self.prog} --help)")

    def format_help(self) -> str:
        """The help, and the names that its options take: finding them takes time."""
        text = super().format_help()
        options = [action.dest for action in self._actions]
        if "--parts" in self._option_string_actions:
            text += load("pictures:help_text")(options)
        return text


def add_command(commands: argparse._SubParsersAction, name: str, what: str) -> Parser:
    """The parser of a command, to which the command adds its own arguments.

    Args:
        what: what the command does, in a line for the help.
    """
    parser = commands.add_parser(name, help=what, description=what[0].upper() + what[1:] + ".")
    parser.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help="show the traceback of errors")
    parser.set_defaults(parts=[])
    return parser


def add_cluster_option(parser: Parser, what: str) -> None:
    """Add the cluster on which the work is done instead of here; ``what`` says which work."""
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help=f"{what} on the workers of a Dask cluster that runs, tcp://host:8786 or tls://host:8786, on local:N "
        "processes of this machine, or on slurm:N jobs; see docs/cluster.md",
    )


def load(target: str) -> Callable:
    """The function that "module:function" names, its module imported only now; one without dots is in this folder."""
    from taichi_tracer.system.importing import import_quickly

    module, function = target.split(":")
    return getattr(import_quickly(module if "." in module else f"taichi_tracer.apps.{module}"), function)


def load_parts(paths: Sequence[str]) -> None:
    """Run the files of ``--parts``, once, before any name is looked up."""
    if paths:
        from taichi_tracer.system.parts import load_parts as load_file

        for path in paths:
            load_file(path)
            if os.path.isdir(path):
                for text in load("taichi_tracer.course.use:in_use")().notes():
                    note(f"--course {path}: {text}")


def values_of(words: list[str], *options: str) -> list[str]:
    """Every value that some options have among the words, before they are parsed."""
    found = [following for word, following in zip(words, words[1:], strict=False) if word in options]
    return found + [word.split("=", 1)[1] for word in words if word.split("=", 1)[0] in options and "=" in word]
