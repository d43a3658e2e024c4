"""Makes every picture of README.md and docs/ again, or finds those that are no longer what the package makes.

    python -m docs.make [--check] [--measured] [FOLDER]

The documents print how their pictures are made. Each ``taichi-tracer render …`` or ``samples …`` is run that ends with
``-o NAME``, if a document shows images/NAME, or with ``-o images/``. If the Python of a document saves a picture that
is shown, all of its Python is run. All this is done on the CPU, each time in a new folder. ``OTHERS`` has the pictures
that no document makes. Charts of times come out differently on every machine; they are made only with ``--measured``,
which takes about a quarter of an hour.

FOLDER is where the pictures go; without it, they replace those in docs/images. With ``--check``, nothing is replaced:
the names of pictures that have become different are printed, and the exit code is 1 if there are some.
"""

import argparse
import os
import re
import runpy
import shlex
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"
COMMANDS = "taichi-tracer render ", "taichi-tracer samples "  # those that write pictures
SLOW = "--denoise"  # commands with this option take minutes, and are run with --measured only
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SHOWN = {name for path in DOCUMENTS for name in re.findall(r"images/([\w.]+)\)", path.read_text(encoding="utf-8"))}


def commands(is_slow: bool = False) -> list[list[str]]:
    """The words of every command of the documents that makes their pictures, each once."""
    found = []
    for path in DOCUMENTS:
        for block in re.findall(r"```sh\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL):
            lines = (shlex.split(line) for line in block.splitlines() if line.startswith(COMMANDS))
            found += [words[1:] for words in lines if "-o" in words and words[-1] in SHOWN | {"images/"}]
    found = [words for words in found if is_slow or SLOW not in words]
    return [words for i, words in enumerate(found) if words not in found[:i]]


def render(words: list[str]) -> None:
    """Run a command of the documents."""
    from taichi_tracer.apps.cli import main

    code = main([*words, *(["--arch", "cpu"] if words[0] == "render" else [])])
    if code != 0:
        raise SystemExit(f"{shlex.join(words)}: ended with {code}")


def programs() -> list[str]:
    """All Python of each document whose Python saves its pictures; each block goes on where the one before it ended."""
    texts = [path.read_text(encoding="utf-8") for path in DOCUMENTS]
    found = ["\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL)) for text in texts]
    return [code for code in found if SHOWN.intersection(re.findall(r'save_image\("([^"]+)"', code))]


def run_program(code: str) -> None:
    """Run the Python of a document."""
    exec(compile(code, "document", "exec"), {})


def pictures_of(run: Callable[[Any], None], what: Any, folder: Path) -> list[Path]:
    """Run a command or a program in a new folder, on the CPU; returns its pictures, copied into ``folder``."""
    from taichi_tracer.system import runtime

    runtime.init("cpu", force=True)
    with tempfile.TemporaryDirectory() as place:
        os.chdir(place)
        try:
            run(what)
        finally:
            os.chdir(ROOT)
        made = sorted(path for path in Path(place).rglob("*") if path.name in SHOWN)
        return [Path(shutil.copy(path, folder / path.name)) for path in made]


def leaks(triangle_test: str) -> Callable[[Path], None]:
    """The leak map of ``taichi-tracer hardcases --report``, for one triangle test in f32."""

    def make(path: Path) -> None:
        from taichi_tracer.files.images import save_image
        from taichi_tracer.studies.hard.case import RayMode
        from taichi_tracer.system import runtime

        runtime.init("cpu", force=True)
        save_image(path, leak_map(RayMode(triangle_test, "f32", False, "wide_bvh")))

    return make


def leak_map(mode, size: int = 320) -> np.ndarray:
    """(size, size, 3) in [0, 1], top row first: what an eye within a closed sphere sees, red where a ray gets out.

    The sphere is white, and lit from inside; the background is red.

    Each pixel's ray is not sent through the pixel's centre but at the point of an edge that is nearest to what lies
    there: a regular ray would meet an edge once in millions.
    """
    from taichi_tracer.contracts.lab import as_f32
    from taichi_tracer.studies.hard.case import SharedScene
    from taichi_tracer.studies.hard.triangle_cases import ClosedSphere

    centre, radius = np.array([100.0, -33.0, 14.0]), 4.0
    stage = SharedScene("leak map", [ClosedSphere("leak map", "leak map", radius, centre, 64, 33)])
    on = stage.build(mode)["leak map"]
    eye = as_f32(centre + radius * np.array([0.1, 0.05, 0.6]))
    ndc = 2 * (np.arange(size) + 0.5) / size - 1
    x, y = np.meshgrid(ndc, -ndc)
    direction = np.stack([x, y, -np.ones_like(x)], axis=-1).reshape(-1, 3)
    eyes = np.broadcast_to(eye, direction.shape)
    seen = on.scene.intersect(eyes, direction)
    ids = np.maximum(on.own(seen), 0)
    v, w = seen.barycentric_coords.astype(np.float64).T
    weights = np.stack([1 - v - w, v, w], axis=1)
    weights[np.arange(len(weights)), weights.argmin(axis=1)] = 0
    weights /= weights.sum(axis=1, keepdims=True)
    target = (on.corners(ids) * weights[:, :, None]).sum(axis=1)
    is_hit = on.scene.intersect(eyes, as_f32(target - eye)).is_hit

    to_light = centre + radius * np.array([-0.35, 0.55, 0.1]) - target
    distance = np.linalg.norm(to_light, axis=1)
    cosine = np.abs((seen.geometric_normal * to_light).sum(axis=1)) / distance
    irradiance = cosine * (radius / distance) ** 2
    shade = 0.5 + 0.5 * irradiance / (irradiance + 0.8)
    image = np.where((is_hit & seen.is_hit)[:, None], shade[:, None], (0.9, 0.0, 0.05))
    on.scene.destroy()
    return image.reshape(size, size, 3)


def accuracy(*words: str) -> Callable[[Path], None]:
    """The chart of ``taichi-tracer accuracy``."""

    def make(path: Path) -> None:
        from taichi_tracer.apps.cli import main

        with tempfile.TemporaryDirectory() as folder:
            main(["accuracy", *words, "--report", folder])
            with Image.open(Path(folder) / "accuracy.png") as chart:  # 64 colours: a fifth of the size
                chart.convert("RGB").quantize(64, dither=Image.Dither.NONE).save(path, optimize=True)

    return make


def frame_time(path: Path) -> None:
    """The chart of ``python -m benchmarks.frames``, which writes to its own place."""
    own = IMAGES / path.name
    runpy.run_module("benchmarks.frames", run_name="__main__")
    if own != path:
        shutil.copy(own, path)


def unseen_light(path: Path) -> None:
    """The four pictures of ``python -m benchmarks.claims pictures``."""
    from benchmarks.claims import pictures
    from taichi_tracer.system import runtime

    runtime.init("cpu", force=True)
    pictures([str(path)])


# The boxes of the diagram: x, y, the title, the folder or file, and whether it is a part that can be replaced.
BOXES = {
    "file": (20, 40, "scene file", "files/", False),
    "scene": (20, 150, "scene", "scene_data.py", False),
    "environment": (20, 260, "environment", "environment.py", True),
    "camera": (230, 40, "camera", "camera.py", True),
    "integrator": (230, 150, "integrator", "integrators/", True),
    "lights": (230, 260, "lights", "lights/", True),
    "sampler": (440, 40, "sampler", "samplers/", True),
    "intersector": (440, 150, "intersector", "intersectors/", True),
    "brdf": (440, 260, "BRDF", "brdfs/", True),
    "film": (650, 40, "film", "picture/film.py", False),
    "error": (650, 150, "error", "error_estimate.py", False),
    "picture": (650, 260, "file, window, page", "files/, apps/", False),
}
WIDE, HIGH = 150, 56
# From, to, and what is passed on.
ARROWS = [
    ("file", "scene", "mesh"),
    ("environment", "scene", ""),
    ("scene", "integrator", ""),
    ("camera", "integrator", "ray"),
    ("integrator", "intersector", "ray, hit"),
    ("integrator", "lights", "light"),
    ("integrator", "brdf", ""),
    ("sampler", "camera", "ξ"),
    ("integrator", "film", ""),
    ("film", "error", "samples"),
    ("error", "picture", "mean"),
]


def architecture(path: Path) -> None:
    """The parts of the package, and what they pass to each other."""

    def border(box: tuple[int, int], other: tuple[int, int]) -> tuple[float, float]:
        """Where the line between the middles of two boxes leaves the first one."""
        dx, dy = other[0] - box[0], other[1] - box[1]
        share = min(WIDE / 2 / abs(dx) if dx else 9, HIGH / 2 / abs(dy) if dy else 9)
        return box[0] + share * dx, box[1] + share * dy

    lines = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 820 356" font-family="sans-serif" text-anchor="middle">',
        '<marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" orient="auto">',
        '<path d="M0 0 8 4 0 8z" fill="#456"/></marker><rect width="820" height="356" fill="#fff"/>',
    ]
    middle = {name: (x + WIDE // 2, y + HIGH // 2) for name, (x, y, *_) in BOXES.items()}
    for start, end, what in ARROWS:
        (x0, y0), (x1, y1) = border(middle[start], middle[end]), border(middle[end], middle[start])
        lines.append(
            f'<path d="M{x0:.0f} {y0:.0f} {x1:.0f} {y1:.0f}" stroke="#456" stroke-width="1.5" marker-end="url(#tip)"/>'
        )
        shift = (0, -7) if y0 == y1 else (32, 4)
        x, y = (x0 + x1) / 2 + shift[0], (y0 + y1) / 2 + shift[1]
        lines.append(f'<text x="{x:.0f}" y="{y:.0f}" font-size="12" fill="#456">{what}</text>' if what else "")
    for x, y, title, place, is_part in BOXES.values():
        fill = "#fde9c9" if is_part else "#e3ecf5"
        lines.append(f'<rect x="{x}" y="{y}" width="{WIDE}" height="{HIGH}" rx="8" fill="{fill}" stroke="#456"/>')
        lines.append(f'<text x="{x + WIDE // 2}" y="{y + 24}" font-size="15" fill="#123">{title}</text>')
        lines.append(f'<text x="{x + WIDE // 2}" y="{y + 43}" font-size="12" fill="#345">{place}</text>')
    lines.append('<text x="410" y="18" font-size="13" fill="#345">yellow: parts that you can replace</text></svg>')
    path.write_text("\n".join(line for line in lines if line) + "\n", encoding="utf-8")


# Name → what makes the picture at a path. The first table takes seconds; the second takes longer, or measures times.
OTHERS = {
    "architecture.svg": architecture,
    "leaks_moller_trumbore.png": leaks("moller_trumbore"),
    "leaks_watertight.png": leaks("watertight"),
}
MEASURED = {
    "accuracy_cornell_box.png": accuracy("cornell_box"),
    "accuracy_bounces.png": accuracy("cornell_box", "--max-bounces", "0,1,2,3,5,8,16,64"),
    "frame_time.svg": frame_time,
    "unseen_light.png": unseen_light,
}


def make(folder: Path, measured: bool = False) -> Iterator[Path]:
    """Make all pictures in a folder, one after the other."""
    for words in commands(measured):
        yield from pictures_of(render, words, folder)
    for code in programs():
        yield from pictures_of(run_program, code, folder)
    for name, maker in (OTHERS | MEASURED if measured else OTHERS).items():
        maker(folder / name)
        yield folder / name


def share_that_differs(made: Path, kept: Path) -> float:
    """The share of the pixels that differ between two pictures; 1 if their sizes do."""
    if made.suffix == ".svg":
        return float(made.read_bytes() != kept.read_bytes())
    one, other = (np.asarray(Image.open(path).convert("RGB")) for path in (made, kept))
    return float((one != other).any(axis=2).mean()) if one.shape == other.shape else 1.0


def check() -> int:
    """Print which pictures have become different; returns how many."""
    stale = 0
    with tempfile.TemporaryDirectory() as folder:
        for path in make(Path(folder)):
            share = share_that_differs(path, IMAGES / path.name)
            if share > 0:
                stale += 1
                print(f"docs/images/{path.name}: {share:.1%} of the pixels differ")
    return stale


def main() -> int:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(description="Makes the pictures of README.md and docs/ again.")
    parser.add_argument("folder", nargs="?", type=Path, default=IMAGES, help="where they go (docs/images)")
    parser.add_argument("--measured", action="store_true", help="the charts of times, too")
    parser.add_argument("--check", action="store_true", help="only tell which have become different")
    args = parser.parse_args()
    sys.path.insert(0, str(ROOT))  # the package and the benchmarks of this checkout
    if args.check:
        return int(check() > 0)
    folder = args.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    for path in make(folder, args.measured):
        print(path)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
