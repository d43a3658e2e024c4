"""The state to which the samples of a picture belong, and how samples are saved and loaded again."""

import json
from pathlib import Path

from taichi_tracer.files.checkpoint import check_same, read_checkpoint, show_ranges, write_checkpoint
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError

PACKAGE = "taichi_tracer."
SHARES = "shares"  # the array of a picture whose pixels do not all take the same samples


def facts_of(renderer) -> dict:
    """Everything that the bits of a picture depend on. Samples with different facts must not be added up."""
    settings, camera = runtime.current(), renderer.camera
    window = camera.compute_half_size(), camera.compute_centre()
    matrix = camera.camera_to_world.to_numpy().tolist()
    return {
        "scene": renderer.scene_data.fingerprint(),
        "camera": repr((camera.name, matrix, *window)),
        renderer.what: renderer.active.name,
        "size": [renderer.width, renderer.height],
        "crop": list(renderer.film.crop),
        "srgb": renderer.srgb,
        "sampler": renderer.sampler.name,
        "seed": renderer.seed,
        "jitter": renderer.jitter,
        "triangle test": renderer.scene_data.ray_intersector.triangle_test,
        "precision": settings.precision,
        "fast math": settings.fast_math,
        **renderer.active.facts(),
        **own_parts(renderer.scene_data),
    }


def own_parts(scene_data) -> dict:
    """The names of the scene's parts that do not belong to the package, because a picture depends on them."""
    library = scene_data.material_library
    parts = {"intersector": [scene_data.ray_intersector]}
    parts["BRDFs"] = [library.brdfs[i] for i in scene_data.effects.brdfs]
    names = {what: [full_name(one) for one in those] for what, those in parts.items()}
    return {what: those for what, those in names.items() if any(not name.startswith(PACKAGE) for name in those)}


def full_name(part) -> str:
    """The full name of a part's class, with its module."""
    return f"{type(part).__module__}.{type(part).__qualname__}"


def save(renderer, path: str | Path) -> None:
    """Write the samples of a picture into a file."""
    if not renderer.is_random:
        name = renderer.active.name
        raise InputError(f"checkpoint: every sample of {name} is the picture itself: nothing to keep")
    ranges = [[renderer.first_sample, renderer.first_sample + renderer.film.samples]]
    renderer.film.unseen.rare = renderer.rarely_met.rows()
    arrays = renderer.film.to_arrays()
    if renderer.shares.are_kept:
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
    if SHARES in arrays and renderer.shares.are_kept:
        renderer.shares.set(arrays[SHARES])
    elif SHARES in arrays:
        renderer.own_shares.begin(arrays[SHARES])
    renderer.film.from_arrays(arrays, ranges[0][1] - ranges[0][0])
