"""``taichi-tracer samples``: where samples of the light go, as tables and pictures."""

from argparse import Namespace
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tqdm import tqdm

from taichi_tracer.apps.rescue import written_bytes
from taichi_tracer.environment import load_environment
from taichi_tracer.files.disk import check_place, make_folder
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.scene_data_loader import find_scene, load_scene_data, scene_names
from taichi_tracer.studies import samples
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.registry import PARTS

IMAGES = (".hdr", ".exr", ".pfm", ".npy", ".png", ".jpg", ".jpeg")
TOP = 5  # lamps of each choice in the table


@dataclass(frozen=True)
class SamplesStudy:
    """What is sampled, how often, and where the pictures go.

    Attributes:
        what: the name or path of an environment, if ``is_environment``, or of a scene.
        size: columns and rows of the maps.
        point, normal: of the surface that is lit; None finds them.
        folder: for the pictures.
    """

    what: str
    is_environment: bool
    count: int
    size: tuple[int, int]
    seed: int
    point: tuple[float, ...] | None
    normal: tuple[float, ...] | None
    folder: Path

    def path(self, name: str) -> Path:
        """The place of a picture."""
        return self.folder / f"samples_{Path(self.what).stem}_{name}.png"


def study_of(args: Namespace) -> SamplesStudy:
    """What the options ask for; the folder is made, and the pictures are known to have a place."""
    samples.check_count(args.count)
    is_environment = names_environment(args.what)
    vectors = {name: getattr(args, name) for name in ("point", "normal")}
    for name, value in vectors.items():
        if value is not None and is_environment:
            raise InputError(f"--{name} belongs to a scene: {args.what} is an environment, the same from every point")
        if value is not None and not np.isfinite(value).all():
            raise InputError(f"--{name} must be three finite numbers, not {' '.join(f'{x:g}' for x in value)}")
    if vectors["normal"] is not None and not np.any(vectors["normal"]):
        raise InputError("--normal must not be 0 0 0")
    point, normal = (None if value is None else tuple(value) for value in vectors.values())
    study = SamplesStudy(args.what, is_environment, args.count, args.size, args.seed, point, normal, Path(args.output))
    make_folder(study.folder, f"--output {args.output}")
    kinds = (samples.UNIFORM, samples.IMPORTANCE) if is_environment else (*PARTS.names("lamp choice"), "shares")
    for name in kinds:
        check_place(study.path(name))
    return study


def names_environment(what: str) -> bool:
    """Whether a word leads to an environment; if not, it leads to a scene.

    Raises:
        InputError: it leads to neither.
    """
    if what in shipped_environments() or Path(what).suffix.lower() in IMAGES:
        return True
    if what not in scene_names() and Path(what).suffix == "":
        known = [*shipped_environments(), *scene_names(), "or the path of an image or a scene"]
        raise one_of("environment or scene", what, known)
    find_scene(what)
    return False


def run(args: Namespace) -> int:
    """Take the samples, print the tables, and write the pictures."""
    study = study_of(args)
    lines, pictures = of_environment(study) if study.is_environment else of_scene(study)
    print("\n".join(lines))
    for name, content in pictures.items():
        print(f"wrote {written_bytes(study.path(name), content)}")
    return 0


def of_environment(study: SamplesStudy) -> tuple[list[str], dict[str, bytes]]:
    """(lines of text, name → PNG) for an environment."""
    environment = load_environment(study.what)
    runtime.ensure()
    with progress(2 * study.count) as bar:
        found = samples.environment_counts(environment, study.count, study.size, study.seed, bar.update)
    title = f"{Path(study.what).stem}, {environment.width}x{environment.height}"
    lines = [f"{title}: {study.count:,} samples, counted in {study.size[0]}x{study.size[1]} cells", ""]
    lines += samples.map_table(found)
    return lines, maps(study, found)


def of_scene(study: SamplesStudy) -> tuple[list[str], dict[str, bytes]]:
    """(lines of text, name → PNG) for the lamps of a scene."""
    scene = load_scene_data(study.what)
    point, normal = study.point, study.normal
    if point is None:
        point, found_normal = samples.centre_of_view(scene)
    else:
        found_normal = samples.normal_at(scene, point)
    normal = found_normal if normal is None else np.asarray(normal) / np.linalg.norm(normal)
    with progress(len(PARTS.all("lamp choice")) * study.count) as bar:
        found = samples.lamp_counts(scene, point, normal, study.count, study.size, study.seed, bar.update)
    where = f"from {vector(point)} with the normal {vector(normal)}"
    lines = [f"{Path(study.what).stem}, {scene.lamps.count:,} lamps: {study.count:,} samples {where}", ""]
    lines += [*samples.choice_table(found), "", *samples.top_table(found, scene, TOP), ""]
    lines += [
        "effective: as many lamps with equal shares have the same entropy, which is in bits.",
        "deviation: of one sample of the light that arrives if nothing blocks it, relative to the mean.",
    ]
    title = f"{Path(study.what).stem}: shares of the lamps"
    return lines, maps(study, found) | {"shares": samples.shares_png(found, title)}


def maps(study: SamplesStudy, found: list[samples.Counts]) -> dict[str, bytes]:
    """Name → PNG of each map; all have the same scale."""
    brightest, of = max(one.cells.max() for one in found), Path(study.what).stem
    return {one.name: samples.map_png(one, int(brightest), f"{of}: {one.total:,} samples, {one.name}") for one in found}


def progress(total: int) -> tqdm:
    """A bar on stderr, if that is a terminal."""
    return tqdm(total=total, unit=" samples", unit_scale=True, disable=None, leave=False)


def vector(values) -> str:
    """Three numbers in brackets."""
    return "(" + ", ".join(f"{round(float(x), 4) + 0.0:g}" for x in values) + ")"
