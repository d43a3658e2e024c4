"""The commands of the command line, a file each. A new command is a new file.

The name of the file is the name of the command, with "_" for "-". The file has

* ``HELP``: what the command does, in a line;
* ``add_arguments(parser)``: adds the command's arguments to its parser;
* ``run(args)``: does the work with the parsed arguments, and returns the exit code.

Every call of the program imports all files of this folder, a help included: what is large is imported within ``run``.
"""

import os

# The order of the help. Commands that are not named here come after these, by their names.
ORDER = (
    "render",
    "merge",
    "turntable",
    "view",
    "export",
    "info",
    "effects",
    "explain",
    "accuracy",
    "samples",
    "compare",
)
ORDER += ("hardcases", "new-part", "check-part", "assignment", "check", "grade", "doctor")


def names() -> list[str]:
    """The names of all commands, in the order of the help."""
    files = (os.path.splitext(file) for folder in __path__ for file in os.listdir(folder))
    found = sorted(name.replace("_", "-") for name, ending in files if ending == ".py" and not name.startswith("_"))
    return sorted(found, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER))
