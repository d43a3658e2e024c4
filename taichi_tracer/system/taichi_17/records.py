"""The questions that the reading of a kernel asked, as bytes: another process asks them of its own objects."""

import functools
import inspect
import io
import pickle
import sys
import types
from collections.abc import Iterator
from typing import Any

from taichi._lib import core

from taichi_tracer.system.seams import runs_in_kernels
from taichi_tracer.system.taichi_17.questions import NUMBERS, PLACED, Met, Notes, One, Place, Question, form_of
from taichi_tracer.system.taichi_17.words import OWN, found, place_word, type_of, type_word, word


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
    try:
        outside = {(kind, place, name): wanted for kind, place, name, wanted in map(placed, questions_of(notes))}
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


def questions_of(notes: Notes) -> Iterator[tuple[Question, Any]]:
    """All questions that are not about objects: those of Taichi, and those of the functions that Python has run."""
    yield from notes.outside.values()
    seen: set[Any] = set()
    waiting = [*functions_in((notes.first, notes.asked, [wanted for _, wanted in notes.outside.values()]))]
    for number, name in notes.asked:
        kept = inspect.getattr_static(type(notes.objects[number]), name, None)
        getter = kept.fget if isinstance(kept, property) else getattr(kept, "func", None)
        waiting += [getter] if isinstance(getter, types.FunctionType) else []
    while waiting:
        function = waiting.pop()
        if function in seen or not (function.__module__ or "").startswith(OWN) or runs_in_kernels(function):
            continue
        seen.add(function)
        names, words = function.__globals__, set(names_in(function.__code__))
        for name in sorted(words & names.keys()):
            values = [(Question("name", names, name), names[name])]
            if isinstance(names[name], types.ModuleType) and names[name].__name__.startswith(OWN):
                there = names[name]
                values += [
                    (Question("attribute", there, one), vars(there)[one]) for one in sorted(words & vars(there).keys())
                ]
            for question, value in values:
                waiting += [value] if isinstance(value, types.FunctionType) else []
                if (wanted := constant(value)) is not None and (id(question.of), question.name) not in notes.outside:
                    yield question, wanted


def functions_in(wanted: Any) -> Iterator[types.FunctionType]:
    """The functions among answers."""
    if isinstance(wanted, One):
        if isinstance(function := wanted.value(), types.FunctionType):
            yield function
    elif isinstance(wanted, (tuple, list, dict)):
        for one in wanted.values() if isinstance(wanted, dict) else wanted:
            yield from functions_in(one)


def names_in(code: types.CodeType) -> Iterator[str]:
    """The names that a function and those in it use besides their own."""
    yield from code.co_names
    for one in code.co_consts:
        if isinstance(one, types.CodeType):
            yield from names_in(one)


def constant(value: Any) -> Any:
    """What another value must be to stand for this one, if nobody changes it by calls; None if somebody may."""
    if isinstance(value, NUMBERS):
        return type(value), value
    if type(value) is tuple:
        elements = [constant(one) for one in value]
        return None if None in elements else (tuple, elements)
    if isinstance(value, functools.partial) or word(value) is None:
        return One(value) if isinstance(value, types.FunctionType) else None
    return One(value)
