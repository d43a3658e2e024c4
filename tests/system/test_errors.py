"""Errors that the user can correct: one line, with what would have worked."""

import pytest

from taichi_tracer.materials import Material
from taichi_tracer.system.errors import (
    InputError,
    MissingFileError,
    StaleSceneError,
    nearest,
    no_argument,
    one_of,
    printable,
)


def test_a_name_that_is_nearly_known_is_suggested():
    error = one_of("view", "nromal", ["hit", "normal", "distance"])
    assert isinstance(error, InputError)
    assert str(error) == "unknown view 'nromal': did you mean 'normal'? known are hit, normal, distance"


def test_a_name_that_is_nothing_like_the_known_ones_is_told_them():
    assert str(one_of("view", "zzz", iter(["hit", "normal"]))) == "unknown view 'zzz': known are hit, normal"
    assert str(one_of("arch", None, ["cpu"])) == "unknown arch None: known are cpu"


def test_a_missing_file_is_both_kinds_of_error():
    with pytest.raises(FileNotFoundError, match=r"^a\.obj: no such file$") as error:
        raise MissingFileError("a.obj: no such file")
    assert isinstance(error.value, InputError)
    assert isinstance(error.value, ValueError)


def test_a_stale_object_is_not_an_error_of_the_input():
    assert not issubclass(StaleSceneError, InputError)


def test_a_similar_name_is_found():
    assert nearest("kd", ["d", "Kd"]) == "Kd"
    assert nearest("dir", ["origin", "direction"]) == "direction"
    assert nearest("zzz", ["origin"]) == ""
    assert "did you mean 'eye'?" in str(no_argument("a camera", "eey", ["eye", "at"]))


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("red", "red"),
        ("größe 光 \u00a0x", "größe 光 \u00a0x"),
        ("\x1b[2J\x07", r"\x1b[2J\x07"),
        ("a\r\u202eb\x9b", r"a\r\u202eb\x9b"),
        ("two\nlines\t", "two\nlines\t"),
        ("\udce9", r"\udce9"),
    ],
)
def test_what_a_terminal_would_obey_is_told_by_its_number(name, shown):
    assert printable(name) == shown
    assert str(InputError(f"{name}: no")) == f"{shown}: no"
    assert Material(name).name == shown.replace("\n", r"\n").replace("\t", r"\t")
