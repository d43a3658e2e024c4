"""The elements of an XML document and of the documents that it includes, one after the other, with file and line.

The parser is Python's expat, and its memory is bounded. A document type is refused before it is read. Therefore there
are no entities, which could expand without limit or name other files and network addresses.
"""

from collections.abc import Callable
from pathlib import Path
from xml.parsers import expat

from taichi_tracer.files.disk import read_bytes
from taichi_tracer.rt3.values import LONGEST_SHOWN, Element
from taichi_tracer.system.errors import InputError

# The size of a document with everything that it includes, in bytes. Larger meshes belong in their own files.
MOST_BYTES = 1 << 26
MOST_ELEMENTS = 200_000
# The equals signs in one file, which bound its attributes: the parser keeps all attributes of an element in memory.
MOST_ATTRIBUTES = 1_000_000
MOST_DEPTH = 64  # of elements within elements; the format itself does not nest elements
MOST_INCLUDES = 1000
MOST_INCLUDES_DEEP = 32


class Elements:
    """Calls ``handle`` for every element except the roots. An ``include`` is replaced by the elements of its file.

    Raises:
        InputError: the file is not XML, or exceeds one of the limits; the message has file and line.
    """

    def __init__(self, handle: Callable[[Element], None], note: Callable) -> None:
        self.handle, self.note = handle, note
        self.bytes = self.elements = self.includes = 0
        self.open: list[Path] = []  # the files that are being read; each one includes the next

    def read(self, path: Path, where: str = "") -> None:
        """Read one document and everything that it includes."""
        prefix = f"{where}: " if where else ""
        resolved = path.resolve()
        if resolved in self.open:
            chain = " -> ".join(p.name for p in [*self.open[self.open.index(resolved) :], resolved])
            raise InputError(f"{prefix}{path.name} includes itself: {chain}")
        if path.is_dir():
            raise InputError(f"{prefix}{path}: this is a folder: give a file in it")
        size = path.stat().st_size if path.is_file() else 0
        self.bytes += size
        if self.bytes > MOST_BYTES:
            told = "the document is" if not self.open else "with what it includes the document is"
            raise InputError(
                f"{prefix}{path}: {told} larger than {MOST_BYTES >> 20} MB: "
                "put meshes into files of their own (.obj .ply) and name them by filename"
            )
        content = read_bytes(path)
        if not content.strip():
            raise InputError(f"{prefix}{path}: the file is empty")
        if content.count(b"=") > MOST_ATTRIBUTES:
            raise InputError(f"{prefix}{path}: more than {MOST_ATTRIBUTES:,} attributes")
        self.open.append(resolved)
        try:
            self._parse(path, content)
        except RecursionError:
            raise InputError(f"{path}: too deeply nested") from None
        self.open.pop()

    def _parse(self, path: Path, content: bytes) -> None:
        parser = expat.ParserCreate()
        parser.buffer_text = True
        depth = 0

        def where() -> str:
            """The file and the line that the parser has reached."""
            return f"{path}:{parser.CurrentLineNumber}"

        def start(tag: str, attributes: dict[str, str]) -> None:
            """Handle the beginning of an element; the root element may have any name."""
            nonlocal depth
            depth += 1
            if depth > MOST_DEPTH:
                raise InputError(f"{where()}: elements are nested more than {MOST_DEPTH} deep: RT3 nests none")
            if depth > 1:
                self._take(Element(tag, attributes, where(), self.note), path)

        def end(tag: str) -> None:
            """Count the end of an element."""
            nonlocal depth
            depth -= 1

        def text(content: str) -> None:
            """Note text between elements, which has no meaning in this format."""
            if content.strip():
                self.note(f"{where()}: text between elements is ignored: {content.strip()[:LONGEST_SHOWN]!r}")

        def refuse(*_) -> None:
            """Refuse a document type before it is read."""
            raise InputError(f"{where()}: a document type (<!DOCTYPE>) and entities are not read: remove them")

        parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, text
        parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
        try:
            parser.Parse(content, True)
        except InputError:
            raise
        except expat.ExpatError as error:
            reason = expat.errors.messages.get(error.code, str(error))
            raise InputError(f"{path}:{error.lineno}: this is not well-formed XML: {reason}") from None
        except (ValueError, LookupError) as error:
            raise InputError(f"{where()}: this is not well-formed XML: {error}") from None

    def _take(self, element: Element, path: Path) -> None:
        """Read what an ``include`` in this file names, or give the element to ``handle``."""
        self.elements += 1
        if self.elements > MOST_ELEMENTS:
            raise InputError(f"{element.where}: more than {MOST_ELEMENTS:,} elements")
        if element.tag == "include":
            self._include(element, path)
        else:
            self.handle(element)
        element.note_unknown()

    def _include(self, element: Element, path: Path) -> None:
        self.includes += 1
        if self.includes > MOST_INCLUDES or len(self.open) > MOST_INCLUDES_DEEP:
            raise InputError(
                f"{element.where}: more than {MOST_INCLUDES:,} files are included, or {MOST_INCLUDES_DEEP} deep"
            )
        target = element.path("filename", path)
        self.read(target, element.where)
