"""Hostile input for the readers and for ``scene.intersect``: an answer or an InputError, in bounded time and memory.

    python -m tests.fuzz --minutes 10 [--seed S] [--only NAME]

runs rounds of new examples until the time is over; round k of seed S is the same every time. ``test_fuzz.py`` runs a
fixed few of them.
"""

import argparse
import io
import resource
import signal
import struct
import sys
import tempfile
import time
import warnings
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import taichi_tracer as tt
from taichi_tracer.environment import checked
from taichi_tracer.files import read
from taichi_tracer.files.images import DECODERS, ENCODERS, read_image
from taichi_tracer.files.readers.mtl import read_mtl
from taichi_tracer.geometry import check, clean
from taichi_tracer.system.errors import InputError
from taichi_tracer.tones.display import Display

SECONDS, MEGABYTES = 20, 4096  # one example may take
ROUND = 200  # examples of each kind in a round of the long run

# ── what files are made of ──

NUMBERS = ["0", "-0", "-1", "1e400", "nan", "-inf", "0x1", "1_0", "1e", "999999999999999999999", "1/", "1//1", "0/0"]
WORDS = ["v", "f", "vn", "usemtl", "mtllib", "#", "newmtl", "Kd", "Ns", "d", "map_Kd", "b.mtl", "\\", "é", "-s"]
MATERIAL = b"newmtl a\nKd 1 1 1\nNs 50\n"
TRIANGLE = b"mtllib b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nusemtl a\nf 1//1 2//1 3//1\n"
PLY = b"""ply\nformat %s 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z
element face 2\nproperty list uchar int vertex_indices\nend_header\n"""
CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1]]
LINES = st.lists(st.sampled_from(NUMBERS + WORDS) | st.text(max_size=4), max_size=6).map(" ".join)
VALUES = [struct.pack("<i", -1), struct.pack("<I", 2**31), struct.pack(">I", 2**31 - 1), struct.pack("<f", np.nan)]


@st.composite
def damaged(draw, good):
    """A good file with bytes changed, cut out, repeated or cut off, and with odd lines."""
    data = bytearray(draw(st.sampled_from(good)))
    for _ in range(draw(st.integers(0, 6))):
        at = draw(st.integers(0, len(data)))
        end = at + draw(st.integers(0, 30))
        with_line = f"\n{draw(LINES)}\n".encode(draw(st.sampled_from(["utf-8", "utf-16"])))
        odd = draw(st.sampled_from([b"", data[at:end] * 2, bytes([draw(st.integers(0, 255))]), with_line, *VALUES]))
        data[at : draw(st.sampled_from([at, at + len(odd), end, len(data)]))] = odd
    return bytes(data)


def ply_files() -> list[bytes]:
    """Text and binary PLY of two triangles."""
    found = [PLY % b"ascii" + b"0 0 0\n1 0 0\n0 1 0\n1 1 1\n3 0 1 2\n3 1 2 3\n"]
    for form, order in ((b"binary_little_endian", "<"), (b"binary_big_endian", ">")):
        faces = struct.pack(f"{order}B3iB3i", 3, 0, 1, 2, 3, 1, 2, 3)
        found.append(PLY % form + np.array(CORNERS, f"{order}f4").tobytes() + faces)
    return found


def image_files(extension: str):
    """A small picture, and what can become of it."""
    rng = np.random.default_rng(3)
    good = [
        ENCODERS[extension](rng.uniform(0, 2, (h, w, 3)).astype(np.float32), False, Display())
        for h, w in ((1, 1), (4, 8))
    ]
    if extension == ".npy":
        for dtype in (np.float64, np.uint8, np.complex64, np.bool_):
            buffer = io.BytesIO()
            np.save(buffer, np.ones((3, 5), dtype))
            good.append(buffer.getvalue())
    return damaged(good)


def readable_images() -> list[str]:
    """Extensions of pictures that can be made and read here."""
    names = [name for name in DECODERS if name in ENCODERS]
    try:
        import OpenImageIO  # noqa: F401
    except ImportError:
        names = [name for name in names if name not in (".exr", ".hdr")]
    return names


# ── what must hold ──


@contextmanager
def bounded():
    """Only InputError is allowed; a hang and too much memory are failures."""

    def stop(*_):
        raise AssertionError(f"it took more than {SECONDS} seconds")

    before = peak_megabytes()  # of all tests that this process has run
    former = signal.signal(signal.SIGALRM, stop)
    signal.alarm(SECONDS)
    try:
        with warnings.catch_warnings(), suppress(InputError):
            warnings.simplefilter("ignore")
            yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, former)
    assert peak_megabytes() - before < MEGABYTES


def peak_megabytes() -> float:
    """The most memory that this process has held."""
    unit = 1 << 20 if sys.platform == "darwin" else 1 << 10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def file_with(name: str, content: bytes) -> Path:
    """A file in a folder of this process, written anew for every example."""
    path = Path(FOLDER.name) / name
    path.write_bytes(content)
    return path


FOLDER = tempfile.TemporaryDirectory(prefix="fuzz")


def read_mesh_file(name: str, content: bytes) -> None:
    """A mesh whose ids exist and whose numbers are finite once cleaned, or an InputError."""
    with bounded():
        mesh = read(file_with(name, content))
        check(mesh)
        tidy = clean(mesh, np.float32)
        assert np.isfinite(tidy.vertices[tidy.faces]).all()
        assert len(tidy.faces) == len(mesh.faces) == len(mesh.face_materials)
        assert (mesh.face_materials >= 0).all()
        assert (mesh.face_materials < len(mesh.materials)).all()


def read_material_file(content: bytes) -> None:
    """Materials of finite numbers, or an InputError."""
    with bounded():
        for material in read_mtl(file_with("b.mtl", content), []).values():
            assert np.isfinite([*material.Kd, *material.Ke, material.Ns, material.d]).all()


def read_image_file(extension: str, content: bytes) -> None:
    """A picture of three channels, which an environment takes or refuses; or an InputError."""
    with bounded():
        image = read_image(file_with(f"image{extension}", content))
        assert image.ndim == 3
        assert image.shape[2] == 3
        assert image.dtype == np.float32
        assert np.isfinite(checked(image, "image")).all()


ANY_FLOAT = st.floats(width=32) | st.sampled_from([0.0, -0.0, 1e-42, 3e38, np.inf, -np.inf, np.nan])
RAY_ARRAYS = st.tuples(
    *[hnp.arrays(np.float32, st.tuples(st.integers(0, 6), st.sampled_from([3, 3, 3, 3, 2, 4])), elements=ANY_FLOAT)] * 2
)
WINDOWS = st.tuples(ANY_FLOAT, ANY_FLOAT)


def ask_scene(scene, rays, window) -> None:
    """Hits between t_min and t_max with finite numbers, and misses with none; or an InputError about shapes."""
    with bounded():
        hits = scene.intersect(*rays, *window)
        hit = hits.is_hit
        for values in (hits.distance, hits.barycentric_coords, hits.normal, hits.geometric_normal):
            assert np.isfinite(values[hit]).all()
            assert not np.isnan(values).any()
        assert (hits.distance[hit] > np.float32(window[0])).all()
        assert (hits.distance[hit] < np.float32(window[1])).all()
        assert (hits.triangle_id[~hit] == -1).all()
        assert (hits.triangle_id[hit] < scene.num_triangles).all()
        assert (scene.occluded(*rays, *window) == hit).all()


def a_scene() -> tt.SceneData:
    """Triangles of many sizes, some of them damaged."""
    rng = np.random.default_rng(4)
    corners = rng.normal(size=(60, 3, 3)) * 10.0 ** rng.uniform(-6, 6, (60, 1, 1))
    corners[::9, 1] = corners[::9, 0]
    corners[5, 2, 1], corners[7, 0, 0] = np.nan, np.inf
    return tt.scene_from_mesh(corners.reshape(-1, 3), np.arange(180).reshape(-1, 3))


def targets(scene=None) -> dict:
    """Name → (strategy, check); ``scene.intersect`` only where a scene is given."""
    file_with("b.mtl", MATERIAL)
    found = {
        "obj": (damaged([TRIANGLE]), lambda content: read_mesh_file("a.obj", content)),
        "mtl": (damaged([MATERIAL]), read_material_file),
        "ply": (damaged(ply_files()), lambda content: read_mesh_file("a.ply", content)),
    }
    for extension in readable_images():
        found[extension[1:]] = (image_files(extension), lambda content, e=extension: read_image_file(e, content))
    if scene is not None:
        found["intersect"] = (st.tuples(RAY_ARRAYS, WINDOWS), lambda rays: ask_scene(scene, *rays))
    return found


def run(strategy, holds, examples: int, number: int) -> None:
    """``holds`` on ``examples`` inputs, those of a number."""

    @seed(number)
    @settings(max_examples=examples, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(strategy)
    def check_one(value):
        holds(value)

    check_one()


def main(words: list[str] | None = None) -> None:
    """The long run; an error where something does not hold, with the smallest input that shows it."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--seed", type=int, default=0, help="of the first round; each round takes the next")
    parser.add_argument("--only", help="the name of one target")
    args = parser.parse_args(words)
    tt.init("cpu")
    chosen = {name: t for name, t in targets(a_scene()).items() if args.only in (None, name)}
    end, number = time.monotonic() + 60 * args.minutes, args.seed
    while time.monotonic() < end:
        for strategy, holds in chosen.values():
            run(strategy, holds, ROUND, number)
        number += 1
    print(f"{number - args.seed} rounds of {ROUND} inputs for each of {', '.join(chosen)}")


if __name__ == "__main__":
    main()
