"""The command line: which commands there are, and how errors are printed.

Each command is a file of ``commands/``: its arguments, and what it runs. Nothing here imports Taichi: ``--help`` and
``--version`` answer at once, and a command loads what it needs.
"""

import os
import signal
import sys
import time
import warnings
from collections.abc import Sequence

import taichi_tracer
from taichi_tracer.apps import commands
from taichi_tracer.apps.console import (
    USER_ERROR,
    Parser,
    add_command,
    let_every_character_print,
    load,
    load_parts,
    note,
    noted,
    values_of,
)
from taichi_tracer.apps.running import EXIT_CODE, moved
from taichi_tracer.system import new_folders
from taichi_tracer.system.errors import IncompleteError, InputError, NotFiniteWarning, StaleSceneError

IMPORTED = time.perf_counter()  # about 0.05 s after the key press


def main(argv: list[str] | None = None) -> int:
    """Run one command; returns the exit code.

    This is 0, 2 when the input cannot be used or a file had to be written elsewhere, 130 when Ctrl-C was pressed.

    Args:
        argv: the words after the program's name; those of this process when None.
    """
    warnings.showwarning = show_warning
    let_every_character_print()
    noted.clear()
    moved.clear()
    words = sys.argv[1:] if argv is None else argv
    parts = values_of(words, "--parts", "--course")
    started = IMPORTED if argv is None else time.perf_counter()
    try:
        load_parts(parts)  # before the words are parsed: a help lists their names
        command = next((word for word in words if word in commands.names()), "")
        args = make_parser(command).parse_args(words)
        load_parts([path for path in args.parts if path not in parts])
        args.started, parts = started, args.parts
        code = args.command(args)
        return code or (USER_ERROR if moved else 0)
    except BrokenPipeError:  # the reader of our output has gone, as in "... | head"
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        new_folders.remove_empty()
        print("taichi-tracer: interrupted", file=sys.stderr)
        return EXIT_CODE + signal.SIGINT
    except Exception as error:
        new_folders.remove_empty()
        text = text_of(error, parts)
        if text is None or "--debug" in words:
            raise
        print(f"taichi-tracer{text}", file=sys.stderr)
        return USER_ERROR


def text_of(error: Exception, parts: Sequence[str]) -> str | None:
    """What the user reads of an error in one line, after the name of the program; None for an error of ours."""
    is_users = isinstance(error, (InputError, IncompleteError, StaleSceneError, OSError))
    text = str(error) if is_users else load("faults:text_of_fault")(error, parts)
    return None if text is None else f": error: {' '.join(text.split())}"


def show_warning(message, category, *_where, **_more) -> None:
    """Print what the library warns of as a note of ours; what other libraries warn of is not the user's to mend."""
    if issubclass(category, UserWarning) and not issubclass(category, NotFiniteWarning):
        note(str(message))


def make_parser(only: str | None = None) -> Parser:
    """The grammar of the command line.

    Args:
        only: the command whose arguments are added; None adds those of all commands, "" those of none.
    """
    parser = Parser(prog="taichi-tracer", description="A teaching ray tracer: pictures, and questions to a scene.")
    parser.add_argument("--version", action="version", version=f"taichi-tracer {taichi_tracer.__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    kinds = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", parser_class=Parser)
    for name in commands.names():
        command = add_command(kinds, name, commands.help_of(name))
        if only is None or name == only:
            module = commands.load(name)
            command.set_defaults(command=module.run)
            module.add_arguments(command)
    return parser
