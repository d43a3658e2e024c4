"""The questions that the reading of a kernel asked, as bytes: another process asks them of its own objects."""

import io
import pickle
import sys
import types
from typing import Any

from taichi._lib import core

from taichi_tracer.system.taichi_17.questions import PLACED, Met, Notes, One, Place, Question, form_of
from taichi_tracer.system.taichi_17.words import found, place_word, trees, type_of, type_word, word


class NoWordError(Exception):
    """Something has no name that means the same in another process, or what has the name is not there."""


class Same(One):
    """Wants what has a word."""

    def __init__(self, text: str) -> None:
        self.text = text

    def is_it(self, value: Any) -> bool:
        """Whether this is what has the word."""
        return word(value) == self.text


class SamePlace(One):
    """Wants a field of Taichi's in the same place of a tree of the same form."""

    def __init__(self, text: str, form: Any) -> None:
        self.text, self.form = text, form

    def is_it(self, value: Any) -> bool:
        """Whether this is such a field."""
        is_field = isinstance(value, PLACED) and form_of(value) == self.form
        return is_field and place_word(value.vars[0].ptr.snode()) == self.text


class Pickler(pickle.Pickler):
    """Writes classes and types of Taichi's as words."""

    def persistent_id(self, value: Any) -> str | None:
        """The word of a class or of a type; None for other values."""
        if isinstance(value, core.DataType):
            return of_this(type_word(value))
        return of_this(word(value)) if isinstance(value, type) else None


class Unpickler(pickle.Unpickler):
    """Reads what ``Pickler`` has written, and imports nothing."""

    def persistent_load(self, text: str) -> Any:
        """What has a word in this process."""
        return type_of(text) if text.startswith("type ") else of_this(found(text))


def of_this(value: Any) -> Any:
    """A value that is there; a NoWordError instead of None."""
    if value is None:
        raise NoWordError
    return value


def written(notes: Notes, **facts: Any) -> bytes | None:
    """The questions and answers of a reading that has just ended, and further facts; None if one has no word.

    Args:
        facts: plain values, classes and Taichi's types.
    """
    stream = io.BytesIO()
    trees.clear()
    try:
        outside = {(kind, place, name): wanted for kind, place, name, wanted in map(placed, notes.outside.values())}
        lists = notes.first, notes.asked, outside, notes.replaced
        Pickler(stream).dump((*map(lasting, lists), facts))
    except (NoWordError, pickle.PicklingError, AttributeError, TypeError):
        return None
    return stream.getvalue()


def read(record: bytes) -> tuple[Notes, dict[str, Any]]:
    """The questions and answers, and the facts.

    Raises:
        NoWordError: it is about something that this process has not imported.
    """
    notes = Notes(())
    notes.first, notes.asked, outside, notes.replaced, facts = Unpickler(io.BytesIO(record)).load()
    for (kind, place, name), wanted in outside.items():
        of = of_this(found(place))
        question = Question(kind, vars(of) if kind == "name" else of, name)
        notes.outside[id(question.of), name] = question, wanted
    return notes, facts


def lasting(wanted: Any) -> Any:
    """An answer, or a container of some, in which objects are words."""
    if isinstance(wanted, Place):
        return SamePlace(of_this(place_word(of_this(wanted.value()).ptr.snode())), wanted.form)
    if isinstance(wanted, One):
        return Same(of_this(word(wanted.value())))
    if isinstance(wanted, Met):
        return Met(wanted.number, lasting(wanted.kind), wanted.layout)
    if type(wanted) in (tuple, list):
        return type(wanted)(map(lasting, wanted))
    return {key: lasting(one) for key, one in wanted.items()} if type(wanted) is dict else wanted


def placed(question: tuple[Question, Any]) -> tuple[str, str, str, Any]:
    """A question with the word of what it is about, and its answer."""
    asked, wanted = question
    if asked.kind == "name":
        module = asked.of.get("__name__", "")
        if vars(sys.modules.get(module, types)) is not asked.of:
            raise NoWordError
        return asked.kind, of_this(word(sys.modules[module])), asked.name, wanted
    return asked.kind, of_this(word(asked.of)), asked.name, wanted
