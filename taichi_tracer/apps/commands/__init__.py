"""The commands of the command line, a file each. A new command is a new file.

The name of the file is the name of the command, with "_" for "-". The file has

* a docstring, whose first line says what the command does: this is its help;
* ``add_arguments(parser)``: adds the command's arguments to its parser;
* ``run(args)``: does the work with the parsed arguments, and returns the exit code.

Only the file of the command that is called is imported.
"""

import os
from pathlib import Path
from types import ModuleType

from taichi_tracer.system.importing import import_quickly

# The order of the help. Commands that are not named here come after these, by their names.
ORDER = ["render", "merge", "turntable", "view", "export", "info", "effects", "explain", "accuracy", "samples"]
ORDER += ["compare", "hardcases", "new-part", "check-part", "assignment", "check", "grade", "doctor"]


def names() -> list[str]:
    """The names of all commands, in the order of the help."""
    files = (os.path.splitext(file) for folder in __path__ for file in os.listdir(folder))
    found = sorted(name.replace("_", "-") for name, ending in files if ending == ".py" and not name.startswith("_"))
    return sorted(found, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER))


def help_of(name: str) -> str:
    """What a command does, in a line: the first line of its file's docstring."""
    for folder in __path__:
        file = Path(folder, f"{name.replace('-', '_')}.py")
        if file.exists():
            line = file.read_text(encoding="utf-8").partition("\n")[0].strip('". ')
            return line[0].lower() + line[1:]
    return ""


def load(name: str) -> ModuleType:
    """The module of a command."""
    return import_quickly(f"{__name__}.{name.replace('-', '_')}")
