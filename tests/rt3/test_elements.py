"""The elements of XML documents and of what they include: no circle, no doubling without end, bounded memory."""

import tracemalloc

import pytest
from rt3_text import HEAD

from taichi_tracer.rt3 import elements
from taichi_tracer.rt3.document import read_rt3
from taichi_tracer.rt3.elements import MOST_INCLUDES, Elements
from taichi_tracer.system.errors import InputError

MEGABYTES = 600.0


@pytest.fixture
def reads(monkeypatch):
    """The names of the files that are read, one for each time."""
    names, read_bytes = [], elements.read_bytes

    def noting(path):
        names.append(path.name)
        return read_bytes(path)

    monkeypatch.setattr(elements, "read_bytes", noting)
    return names


def elements_of(path):
    """(tag, attributes, line) of every element but the roots, and the notes."""
    found, notes = [], []

    def handle(element):
        for name in element.attributes:
            element.find(name)
        found.append((element.tag, element.attributes, int(element.where.rpartition(":")[2])))

    Elements(handle, notes.append).read(path)
    return found, notes


def test_elements_come_in_their_order_with_their_lines(tmp_path):
    (tmp_path / "b.xml").write_text('<any>\n<two x="1"/></any>')
    (tmp_path / "a.xml").write_text('<any>\n<one/>\n<include filename="b.xml"/>\n<three><four/></three>\nwords</any>')
    found, notes = elements_of(tmp_path / "a.xml")
    assert found == [("one", {}, 2), ("two", {"x": "1"}, 2), ("three", {}, 4), ("four", {}, 4)]
    assert notes == [f"{tmp_path}/a.xml:5: text between elements is ignored: 'words'"]


def test_cycles_of_includes_are_named(tmp_path):
    for name, next_one in zip("abc", "bca", strict=True):
        (tmp_path / f"{name}.xml").write_text(f'<RT3><include filename="{next_one}.xml"/></RT3>')
    with pytest.raises(InputError, match=r"c\.xml:1: a\.xml includes itself: a\.xml -> b\.xml -> c\.xml -> a\.xml"):
        read_rt3(tmp_path / "a.xml")


def test_includes_that_double_end(tmp_path, reads):
    """30 files, each of which includes the next twice: 2^30 readings, of which 1,000 are done after the first."""
    for k in range(30):
        (tmp_path / f"{k}.xml").write_text(f"<RT3>{f'<include filename={chr(34)}{k + 1}.xml{chr(34)}/>' * 2}</RT3>")
    (tmp_path / "30.xml").write_text("<RT3/>")
    with pytest.raises(InputError, match="more than 1,000 files are included"):
        read_rt3(tmp_path / "0.xml")
    assert len(reads) == 1 + MOST_INCLUDES


@pytest.mark.long
@pytest.mark.parametrize(
    ("size", "times", "told"),
    [(200, 0, "larger than 64 MB"), (60, 1, "fovy must be a finite number, not '1111")],
)
def test_an_attribute_of_many_megabytes_takes_bounded_memory(size, times, told, tmp_path, reads):
    """200 MB are refused unread; 60 MB are read once, and found to be no number."""
    path = tmp_path / "scene.xml"
    with path.open("wb") as file:
        file.write(HEAD.encode() + b'<camera type="perspective" fovy="')
        for _ in range(size):
            file.write(b"1" * 1_000_000)
        file.write(b'"/></RT3>')
    tracemalloc.start()
    with pytest.raises(InputError) as error:
        read_rt3(path)
    peak = tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    path.unlink()
    assert told in str(error.value)
    assert reads == ["scene.xml"] * times
    assert peak < MEGABYTES


def test_a_missing_document_is_named(tmp_path):
    with pytest.raises(InputError, match="gone.xml: no such file"):
        read_rt3(tmp_path / "gone.xml")
    with pytest.raises(InputError, match="this is a folder"):
        read_rt3(tmp_path)
