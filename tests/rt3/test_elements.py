"""The elements of XML documents and their values: no circle, no doubling without end, one clear line for each error."""

import numpy as np
import pytest

from taichi_tracer.rt3.document import read_rt3
from taichi_tracer.rt3.elements import FLAGS, Element
from taichi_tracer.system.errors import InputError


def test_cycles_of_includes_are_named(tmp_path):
    for name, next_one in zip("abc", "bca", strict=True):
        (tmp_path / f"{name}.xml").write_text(f'<RT3><include filename="{next_one}.xml"/></RT3>')
    with pytest.raises(InputError, match=r"c\.xml:1: a\.xml includes itself: a\.xml -> b\.xml -> c\.xml -> a\.xml"):
        read_rt3(tmp_path / "a.xml")


def element(**attributes):
    """An element in line 7, whose notes are collected."""
    notes = []
    made = Element("thing", attributes, "a.xml:7", notes.append)
    made.notes = notes
    return made


def refused(method, *names, **options):
    """What an element says of a value."""
    with pytest.raises(InputError) as error:
        method(*names, **options)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_numbers_are_counted_and_finite():
    e = element(three=" 1 2.5\n-3e2 ", two="1 2", word="1 x 3", nan="1 nan 3")
    np.testing.assert_array_equal(e.numbers("three"), [1, 2.5, -300])
    np.testing.assert_array_equal(e.numbers("two", count=(2, 3)), [1, 2])
    assert e.numbers("missing") is None
    assert e.numbers("missing", default=5) == 5
    for name in ("two", "word", "nan"):
        told = refused(e.numbers, name)
        assert told == f"a.xml:7: <thing> {name} must be 3 finite numbers, not {e.attributes[name]!r}"
    assert "2 or 4 finite numbers" in refused(e.numbers, "three", count=(2, 4))


@pytest.mark.parametrize("text", ["0", "-1", "1.5", "1e3", "four", "", "99999999999999", "१"])
def test_whole_numbers_are_digits_within_limits(text):
    assert refused(element(n=text).whole, "n").startswith("a.xml:7: <thing> n must be a whole number from 1 to ")
    assert element(n=" 12 ").whole("n") == 12
    assert element(n="0").whole("n", least=0) == 0
    assert element().whole("n", default=3) == 3


def test_flags_are_words():
    for word, meaning in (("yes", True), ("TRUE", True), (" on ", True), ("1", True), ("no", False), ("Off", False)):
        assert element(f=word).choice("f", of=FLAGS, default=not meaning) is meaning
    assert element().choice("f", of=FLAGS, default=True) is True
    assert refused(element(f="maybe").choice, "f", of=FLAGS, default=True).endswith("no, false, off, 0")


def test_colours_of_one_element_are_judged_together():
    """C-13: above 1 anywhere, all are in 0…255; one number is a grey."""
    assert element(a="0.5", b="0 1 0.25").colors("a", "b", "c") == {"a": (0.5,) * 3, "b": (0, 1, 0.25)}
    assert element(a="1", b="51 0 255").colors("a", "b") == {"a": (1 / 255,) * 3, "b": (0.2, 0, 1)}
    for text in ("0 256 0", "0 -1 0"):
        assert "must be a colour, each component in 0…1 or in 0…255" in refused(element(a=text).colors, "a")


def test_tables_are_groups_of_numbers():
    e = element(t="1 2 3\n4 5 6", whole="0 1 2", half="0 1.5 2", odd="1 2 3 4", word="1 2 z", none="  ")
    np.testing.assert_array_equal(e.table("t", 3), [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(e.table("whole", 3, np.int64), [[0, 1, 2]])
    assert e.table("missing", 3) is None
    assert "<thing> half must be whole numbers: " in refused(e.table, "half", columns=3, dtype=np.int64)
    assert refused(e.table, "word", columns=3).endswith("finite numbers: could not convert string to float: 'z'")
    for name in ("odd", "none"):
        assert "finite numbers in groups of 3" in refused(e.table, name, columns=3)


def test_attributes_that_nobody_asked_for_are_told_with_the_nearest_known_one():
    e = element(radius="1", radios="2", zzz="3")
    e.number("radius")
    e.note_unknown()
    assert e.notes == [
        "a.xml:7: unknown attribute of <thing> 'radios': did you mean 'radius'? known are radius",
        "a.xml:7: unknown attribute of <thing> 'zzz': known are radius",
    ]
