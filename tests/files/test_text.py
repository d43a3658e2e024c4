"""Text files: encodings, line ends, joined lines, comments, and numbers that may not be any."""

import pytest

from taichi_tracer.files.readers.text import decode, number, numbered_lines, read_text
from taichi_tracer.system.errors import InputError


@pytest.fixture
def text_of(tmp_path):
    """Reads bytes as the text file a.txt."""

    def read(content):
        (tmp_path / "a.txt").write_bytes(content)
        return read_text(tmp_path / "a.txt")

    return read


@pytest.mark.parametrize(
    ("content", "lines"),
    [
        (b"a \\\nb\nc\n", [(1, "a b"), (3, "c")]),
        (b"a\\\r\nb\\  \r\nc\r\nd", [(1, "a b c"), (4, "d")]),
        (b"# C:\\scenes\\\nb\nc # \\\nd\n", [(1, "# C:\\scenes\\"), (2, "b"), (3, "c # \\"), (4, "d")]),
        (b"a\\b\nc\n", [(1, "a\\b"), (2, "c")]),
        (b"a\\\n\nb\n", [(1, "a"), (3, "b")]),
        (b"a\\", [(1, "a\\")]),
    ],
)
def test_joined_lines_have_the_number_of_their_first_part(text_of, content, lines):
    assert [(k, " ".join(line.split())) for k, line in numbered_lines(text_of(content))] == lines


def test_binary_files_are_refused_by_name(text_of):
    with pytest.raises(InputError, match=r"a\.txt: this is a binary file, not text"):
        text_of(b"v 0 0 0\n\0")


def test_text_is_utf_8_or_else_latin_1():
    assert decode("Grün €".encode()) == "Grün €"
    assert decode("Grün".encode("latin-1")) == "Grün"


@pytest.mark.parametrize("word", ["", "x", "1_0", "1,5", "0x1", "1.5.3", "١", "1e"])
def test_what_is_no_number_names_its_place(word):
    with pytest.raises(InputError, match=f"^a.obj:3: {word!r} is not a number$"):
        number(word, "a.obj:3")
