"""Readers and writers of files; no other folder knows file formats.

A file has one format: it returns a ``Mesh`` or an array, and its errors name the file, the line and the value. Add a
format as a new file; then enter meshes in ``READERS`` of ``meshes.py``, and images in ``ENCODERS`` of ``images.py``.
"""

from pathlib import Path

from taichi_tracer.files import meshes
from taichi_tracer.files.disk import read_bytes
from taichi_tracer.files.images import one_line
from taichi_tracer.files.readers.obj import read_obj
from taichi_tracer.geometry import Mesh, check
from taichi_tracer.system.errors import InputError

EXTENSIONS = (".obj", *meshes.READERS)


def read(path: str | Path) -> Mesh:
    """Read a mesh; the extension of the file decides how. Vertex normals are read and never computed.

    Raises:
        InputError: the extension is not known, or the file cannot be used.
    """
    path = Path(path)
    extension = path.suffix.lower()
    if path.is_dir():
        raise InputError(f"{path}: this is a folder: give a file in it")
    if extension not in EXTENSIONS:
        raise InputError(f"{path}: unknown file type {path.suffix!r}: known are {', '.join(EXTENSIONS)}, and .xml")
    notes: list[str] = []
    try:
        mesh = read_obj(path) if extension == ".obj" else meshes.READERS[extension](read_bytes(path), path, notes)
        check(mesh)
    except Exception as error:  # damaged files make all kinds of errors
        if extension == ".obj" or str(error).startswith(f"{path}: "):
            raise
        reason = f"{one_line(error)} is missing" if isinstance(error, KeyError) else one_line(error)
        raise InputError(f"{path}: cannot be read as {extension[1:].upper()} ({reason})") from None
    mesh.notes += [f"{path}: {note}" for note in notes]
    if len(mesh.faces) == 0 and not mesh.instances:
        raise InputError(f"{path}: the file has no triangles")
    return mesh
