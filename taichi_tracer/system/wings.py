"""The wings: folders of the package that can each be taken off. What is left loads, renders and answers rays as before.

What needs a wing asks for it by ``wing``, so that one line tells the user if it is missing.
"""

from pathlib import Path
from types import ModuleType

from taichi_tracer.system.errors import InputError
from taichi_tracer.system.importing import import_quickly

PACKAGE = Path(__file__).parents[1]

# Folder → what it does.
WINGS = {
    "apps": "has the command line, the windows and the pages",
    "contracts": "checks parts of one's own",
    "cluster": "renders and grades on several machines",
    "course": "runs files that were written for the Taichi course",
    "explain": "explains pixels",
    "rt3": "reads and renders scene files of RT3",
    "studies": "measures what accuracy costs",
    "teaching": "hands out assignments and grades them",
}


class MissingWingError(InputError, ModuleNotFoundError):
    """A wing that this installation lacks is needed."""

    def __str__(self) -> str:
        return str(self.args[0])


def is_there(module: str) -> bool:
    """Whether a module, named within the package, belongs to no wing, or to one that this installation has."""
    folder = module.split(".")[0]
    return folder not in WINGS or (PACKAGE / folder).exists()


def missing_wing(error: Exception) -> str | None:
    """The folder that an import did not find, if it is a wing that this installation lacks; otherwise None."""
    name = error.name if isinstance(error, ModuleNotFoundError) else None
    first, *rest = (name or "").split(".")
    return rest[0] if first == PACKAGE.name and rest and not is_there(rest[0]) else None


def wing(module: str, why: str = "") -> ModuleType:
    """A module of the package that may belong to a wing, such as "rt3.document".

    Args:
        why: what the message begins with, such as the file that needs the module.

    Raises:
        MissingWingError: "this installation has no taichi_tracer/rt3, which reads and renders scene files of RT3".
    """
    try:
        return import_quickly(f"{PACKAGE.name}.{module}")
    except ModuleNotFoundError as error:
        missing = missing_wing(error)
        if missing is None:
            raise
        text = f"this installation has no {PACKAGE.name}/{missing}, which {WINGS[missing]}"
        raise MissingWingError(f"{why}: {text}" if why else text) from None
