"""How long does it take to read an OBJ file of a million triangles? ``python -m benchmarks.obj_reader``"""

import argparse
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.measure import describe_machine
from benchmarks.meshes import displaced_sphere
from taichi_tracer.files.obj import read_obj

CORNERS = {
    "f a b c": "{0}",
    "f a/t b/t c/t": "{0}/{0}",
    "f a//n b//n c//n": "{0}//{0}",
    "f a/t/n b/t/n c/t/n": "{0}/{0}/{0}",
}


def write_obj(path: Path, points: np.ndarray, triangles: np.ndarray, corner: str) -> None:
    """Write an OBJ file. If ``corner`` has normals or texture coordinates, there are as many of them as vertices."""
    face = "f " + " ".join(corner.replace("{0}", f"{{{k}}}") for k in range(3)) + "\n"
    with open(path, "w") as file:
        file.writelines("v {:.6f} {:.6f} {:.6f}\n".format(*p) for p in points.tolist())
        if corner.count("{0}") > 1 + corner.count("//"):
            file.writelines("vt {:.6f} {:.6f}\n".format(*p[:2]) for p in points.tolist())
        if corner != "{0}":
            file.writelines("vn {:.6f} {:.6f} {:.6f}\n".format(*p) for p in points.tolist())
        file.writelines(face.format(*t) for t in (triangles + 1).tolist())


def seconds_to_read(path: Path) -> float:
    """The time that one reading of a file takes."""
    start = time.perf_counter()
    read_obj(path)
    return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--triangles", type=int, default=1_000_000, help="about how many (default: %(default)s)")
    parser.add_argument("--repeats", type=int, default=5, help="how often each file is read (default: %(default)s)")
    arguments = parser.parse_args()

    print(describe_machine())
    points, triangles = displaced_sphere(arguments.triangles)
    print(f"{len(triangles)} triangles, {len(points)} vertices, median of {arguments.repeats}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sphere.obj"
        for style, corner in CORNERS.items():
            write_obj(path, points, triangles, corner)
            seconds = statistics.median(seconds_to_read(path) for _ in range(arguments.repeats))
            print(
                f"{style:<20} {path.stat().st_size / 1e6:6.1f} MB {seconds:6.2f} s "
                f"{len(triangles) / seconds:12,.0f} triangles/s"
            )


if __name__ == "__main__":
    main()
