"""Readers and writers of files; no other folder knows file formats.

A file has one format: it returns a ``Mesh`` or an array, and its errors name the file, the line and the value. Add a
format as a new file; then enter meshes in ``READERS`` of ``meshes.py``, and images in ``ENCODERS`` of ``images.py``.
"""

from pathlib import Path

from taichi_tracer.files import meshes
from taichi_tracer.geometry import Mesh
from taichi_tracer.system.errors import InputError

EXTENSIONS = (".obj", *meshes.EXTENSIONS)


def read(path: str | Path) -> Mesh:
    """Read a mesh; the extension of the file decides how.

    Raises:
        InputError: the extension is not known, or the file cannot be used.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"{path}: this is a folder: give a file in it")
    extension = path.suffix.lower()
    if extension not in EXTENSIONS:
        raise InputError(f"{path}: unknown file type {path.suffix!r}: known are {', '.join(EXTENSIONS)}")
    if extension == ".obj":
        from taichi_tracer.files.readers.obj import read_obj

        mesh = read_obj(path)
    else:
        mesh = meshes.read_mesh(path)
    if len(mesh.faces) == 0 and not mesh.instances:
        raise InputError(f"{path}: the file has no triangles")
    return mesh
