"""What machines must have in common so that their samples have the same bits: package, Taichi, Python, precision."""

import hashlib
import importlib.metadata
import sys
from functools import cache
from pathlib import Path

import taichi_tracer

SOURCE_DIGITS = 12  # of the hash of the package's source: two copies of one version may still differ


def installation() -> dict[str, str]:
    """What is installed here, without importing Taichi."""
    return {
        "taichi_tracer": f"{taichi_tracer.__version__} (source {source_hash()})",
        "Taichi": importlib.metadata.version("taichi"),
        "Python": f"{sys.version_info.major}.{sys.version_info.minor}",
    }


@cache
def source_hash() -> str:
    """A hash of the package's Python files, in which ends of lines do not count."""
    digest, package = hashlib.sha256(), Path(taichi_tracer.__file__).parent
    for path in sorted(package.rglob("*.py"), key=lambda path: path.relative_to(package).as_posix()):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:SOURCE_DIGITS]


def difference(theirs: dict[str, str], ours: dict[str, str]) -> str:
    """What differs, by name with both values: "Taichi 1.7.3 there, 1.7.4 here"; "" if nothing does."""
    names = [name for name in ours if theirs.get(name) != ours[name]]
    return ", ".join(f"{name} {theirs.get(name, 'unknown')} there, {ours[name]} here" for name in names)
