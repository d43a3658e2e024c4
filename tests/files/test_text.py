"""Text files: encodings, line ends, joined lines, comments, and numbers that may not be any."""

import numpy as np
import pytest

from taichi_tracer.files.disk import read_bytes
from taichi_tracer.files.obj import DIGITS, WORDS
from taichi_tracer.files.text import Lines, decode, name_in, number, numbered_lines, read_text, shapes
from taichi_tracer.system.errors import InputError, MissingFileError


@pytest.fixture
def text_of(tmp_path):
    """Reads bytes as the text file a.txt."""

    def read(content):
        (tmp_path / "a.txt").write_bytes(content)
        return read_text(tmp_path / "a.txt")

    return read


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"", b"\n"),
        (b"a", b"a\n"),
        (b"a\n", b"a\n"),
        (b"a\r\nb\r\n", b"a\nb\n"),
        (b"a\rb\r", b"a\nb\n"),
        (b"a\n\r\nb", b"a\n\nb\n"),
        (b"\xef\xbb\xbfa\n", b"a\n"),
    ],
)
def test_every_line_ends_in_a_newline(text_of, content, text):
    assert text_of(content) == text


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


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(MissingFileError, match=r"none\.txt: no such file"):
        read_bytes(tmp_path / "none.txt")
    with pytest.raises(FileNotFoundError):
        read_text(tmp_path / "none.txt")


def test_a_folder_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="this is a folder"):
        read_bytes(tmp_path)


def test_text_is_utf_8_or_else_latin_1():
    assert decode("Grün €".encode()) == "Grün €"
    assert decode("Grün".encode("latin-1")) == "Grün"


@pytest.mark.parametrize(
    ("rest", "name"),
    [
        (" red ", "red"),
        ("\tred wall", "red wall"),
        (" Wall #2", "Wall #2"),
        (" a#b # c", "a#b"),
        (" a #", "a"),
        (" # nothing", ""),
        ("", ""),
    ],
)
def test_a_name_fills_the_rest_of_its_line(rest, name):
    assert name_in(rest) == name


@pytest.mark.parametrize("word", ["1", "-.5", "+3.", "1e-310", "0.1", "123456789012345678901234567890"])
def test_numbers_are_the_nearest_float64(word):
    assert number(word, "a.obj:3") == float(word)


@pytest.mark.parametrize("word", ["", "x", "1_0", "1,5", "0x1", "1.5.3", "١", "1e"])
def test_what_is_no_number_names_its_place(word):
    with pytest.raises(InputError, match=f"^a.obj:3: {word!r} is not a number$"):
        number(word, "a.obj:3")


# Lines by their first word


def test_lines_are_taken_by_their_whole_first_word():
    lines = Lines(b"v 1\nvn 2\n  v\t3\nvv 4\nv\nx v 5\n")
    block = lines.take(b"v")
    assert [line.strip() for line in block.lines()] == ["1", "3", ""]
    assert block.ids.tolist() == [0, 2, 4]
    assert block.numbers.tolist() == [1, 3, 5]
    assert len(block) == 3


def test_lines_are_taken_once():
    lines = Lines(b"v 1\nf 2\nv 3\n")
    assert (len(lines.take(b"v")), len(lines.take(b"v"))) == (2, 0)
    assert [line.strip() for line in lines.take(b"f").lines()] == ["2"]


def test_what_follows_a_taken_word_does_not_become_a_first_word():
    lines = Lines(b"v f 1\nf 2\n")
    lines.take(b"v")
    assert [line.strip() for line in lines.take(b"f").lines()] == ["2"]


def test_a_joined_line_counts_once_and_keeps_later_numbers_right(text_of):
    block = Lines(text_of(b"a \\\n1\nb \\\n\\\n2\na 3\n")).take(b"a")
    assert [line.split() for line in block.lines()] == [["1"], ["3"]]
    assert block.ids.tolist() == [0, 2]
    assert block.numbers.tolist() == [1, 6]


@pytest.mark.parametrize("text", [b"\n", b"\n\n \n", b"x\n"])
def test_a_word_that_is_not_there_gives_an_empty_block(text):
    block = Lines(text).take(b"v")
    assert (len(block), block.text, block.lines()) == (0, b"", [])


def test_a_word_at_the_end_of_the_text_is_compared_within_it():
    assert len(Lines(b"a\nuse\n").take(b"usemtl")) == 0


def test_comments_are_cut_from_every_line():
    block = Lines(b"v 1 # one\nv 2#two\nv #\n").take(b"v").without_comments()
    assert [line.strip() for line in block.lines()] == ["1", "2", ""]
    assert block.numbers.tolist() == [1, 2, 3]


# Shapes


def test_lines_of_one_kind_have_one_shape():
    known, which = shapes(b" 12//7 3//7\n 4//70 555//1\n", DIGITS)
    assert known == [b" 0//0 0//0"]
    assert which.tolist() == [0, 0]


def test_shapes_are_numbered_by_first_appearance():
    known, which = shapes(b"1 2\n1/2\n33 44\n1//2\n-1\n", DIGITS)
    assert known == [b"0 0", b"0/0", b"0//0", b"-0"]
    assert which.tolist() == [0, 1, 0, 2, 3]


def test_words_of_any_kind_look_alike():
    known, which = shapes(b" 1.5 -2e3\n ab\tc\n x\n", WORDS)
    assert [shape.count(b"x") for shape in known] == [2, 1]
    assert np.array_equal(which, [0, 0, 1])
