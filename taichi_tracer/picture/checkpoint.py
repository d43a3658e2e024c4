"""The state to which the samples of a picture belong, and how samples are saved and loaded again.

A checkpoint is an archive of numpy's: arrays, and among them the facts as JSON.
"""

import hashlib
import io
import json
from pathlib import Path

import numpy as np

from taichi_tracer.files.disk import read_bytes, replace_file
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.own_code.checks import is_packages

EXTENSION = ".checkpoint"
FACTS = "facts as JSON"  # the name of their array
# Hexadecimal digits of a fingerprint: 128 bits, so that two different scenes practically never share one.
FINGERPRINT_DIGITS = 32
SHARES = "shares"  # the array of a picture whose pixels do not all take the same samples


def facts_of(renderer) -> dict:
    """Everything that the bits of a picture depend on. Samples with different facts must not be added up."""
    settings, camera, scene = runtime.current(), renderer.camera, renderer.scene_data
    window = camera.compute_half_size(), camera.compute_centre()
    matrix = camera.camera_to_world.to_numpy().tolist()
    # A picture depends also on the classes of parts that do not belong to the package.
    parts = [scene.ray_intersector, *(scene.material_library.brdfs[i] for i in scene.effects.brdfs)]
    return {
        "scene": fingerprint(scene),
        "camera": repr((camera.name, matrix, *window)),
        renderer.what: renderer.active.name,
        "size": [renderer.width, renderer.height],
        "crop": list(renderer.film.crop),
        "srgb": renderer.srgb,
        "sampler": renderer.sampler.name,
        "seed": renderer.seed,
        "jitter": renderer.jitter,
        "triangle test": scene.ray_intersector.triangle_test,
        "precision": settings.precision,
        "fast math": settings.fast_math,
        **renderer.active.facts(),
        "own parts": [f"{c.__module__}.{c.__qualname__}" for c in map(type, parts) if not is_packages(c)],
    }


def save(renderer, path: str | Path) -> None:
    """Write the samples of a picture into a file."""
    if not renderer.is_random:
        raise InputError(f"checkpoint: every sample of {renderer.active.name} is the picture itself: nothing to keep")
    ranges = [[renderer.first_sample, renderer.first_sample + renderer.film.samples]]
    renderer.find_rare_light()
    arrays = renderer.film.to_arrays()
    if renderer.shares.are_uneven:
        arrays[SHARES] = renderer.shares.to_image()
    write_checkpoint(path, {"samples": ranges, **renderer.facts()}, arrays)


def load(renderer, path: str | Path) -> None:
    """Load the samples of a file. If they belong to something else, raise an InputError and change nothing."""
    facts, arrays = read_checkpoint(path)
    ranges = facts.pop("samples", None)
    check_same(path, facts, "this picture", json.loads(json.dumps(renderer.facts())))
    if len(ranges) != 1 or ranges[0][0] != renderer.first_sample:
        raise InputError(f"{path}: holds the samples {show_ranges(ranges)}, not those from {renderer.first_sample} on")
    renderer.film.check_arrays(arrays, path)
    renderer.begin()
    if SHARES in arrays:
        renderer.shares.set(arrays[SHARES])
    renderer.film.from_arrays(arrays, ranges[0][1] - ranges[0][0])


def fingerprint(scene: SceneData) -> str:
    """A hash of everything in the scene on which a picture depends."""
    mesh, sky, lamps = scene.mesh, scene.environment, scene.lamps
    facts = [list(mesh.materials), scene.material_library.has_both_models, scene.up_axis]
    facts += [(light.name, light.facts()) for light in scene.lights]
    arrays: list = [mesh.vertices, mesh.faces, mesh.face_materials, mesh.normals, mesh.face_normals]
    arrays += [mesh.spheres, mesh.sphere_ids, mesh.sphere_materials]
    arrays += [] if mesh.placed is None else [mesh.placed.matrices, mesh.placed.object_of, mesh.placed.primitives]
    arrays += [array for array in (mesh.face_culls, mesh.corner_uv, mesh.corner_color) if array is not None]
    if scene.background is not None:
        arrays += [scene.background.pixels, np.array([scene.background.corners])]
    if sky is not None:
        arrays += [sky.pixels, np.array([sky.intensity, sky.rotation])]
        facts.append(sky.lookup)
    if lamps.count > 0:
        facts.append((lamps.choice.name, lamps.two_sided))
    digest = hashlib.sha256(repr(facts).encode())
    for array in arrays:
        digest.update(f"{array.shape} {array.dtype}".encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()[:FINGERPRINT_DIGITS]


# ── files ──


def write_checkpoint(path: str | Path, facts: dict, arrays: dict[str, np.ndarray]) -> None:
    """Write a checkpoint, either completely or not at all.

    Args:
        facts: which samples these are, and the picture to which they belong; values that JSON can represent.
        arrays: name → array.
    """
    buffer = io.BytesIO()
    np.savez(buffer, **{FACTS: np.array(json.dumps(facts))}, **arrays)
    replace_file(path, buffer.getvalue())


def read_checkpoint(path: str | Path) -> tuple[dict, dict[str, np.ndarray]]:
    """The facts and the arrays of a checkpoint.

    Raises:
        InputError: the file is not a checkpoint, is truncated, or has been changed.
    """
    raw = read_bytes(path)
    try:
        with np.load(io.BytesIO(raw), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
            return json.loads(str(arrays.pop(FACTS))), arrays
    except Exception:  # damaged archives raise all kinds of errors
        raise InputError(f"{path}: this is no checkpoint of taichi_tracer, or it is damaged") from None


def check_same(path: str | Path, facts: dict, other: str, theirs: dict) -> None:
    """Raise an InputError if a checkpoint and another one, or a picture, do not belong together.

    Args:
        path, facts: the checkpoint.
        other, theirs: the name of the other checkpoint or picture in messages, and its facts.
    """
    for name in [*theirs, *(name for name in facts if name not in theirs)]:
        mine, wanted = facts.get(name), theirs.get(name)
        if mine != wanted:
            detail = "" if name in ("scene", "camera") else f": {mine} there, {wanted} here"
            raise InputError(f"{path}: its samples do not belong to {other}: another {name}{detail}")


def show_ranges(ranges: list[list[int]]) -> str:
    """The text for ranges of sample indices: "0 to 63"."""
    return ", ".join(f"{first} to {end - 1}" for first, end in ranges)
