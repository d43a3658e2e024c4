"""``taichi-tracer merge``: the samples of two renderings of one picture, added."""

from argparse import Namespace
from pathlib import Path

from taichi_tracer.apps.render_request import note_linear
from taichi_tracer.apps.words import note
from taichi_tracer.files import checkpoint
from taichi_tracer.files.disk import check_place
from taichi_tracer.files.images import ENCODERS, check_writable, save_image
from taichi_tracer.picture.film import Film
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.registry import PARTS
from taichi_tracer.tones.display import Display


def run(args: Namespace) -> int:
    """Add two checkpoints; write a checkpoint, or a picture if the ending is one of a picture's."""
    output, display = Path(args.output), Display(args.exposure, args.tone)
    is_picture = output.suffix.lower() in ENCODERS
    if is_picture:
        check_writable(output)
        note_linear(display, [output])
    elif output.suffix == checkpoint.EXTENSION:
        check_place(output)
    else:
        known = ", ".join([checkpoint.EXTENSION, *ENCODERS])
        raise InputError(f"-o {output}: unknown file type {output.suffix!r}: known are {known}")
    (facts, arrays), (other_facts, other_arrays) = (
        checkpoint.read_checkpoint(path) for path in (args.first, args.second)
    )
    first, second = facts.pop("samples"), other_facts.pop("samples")
    checkpoint.check_same(args.second, other_facts, args.first, facts)
    try:
        ranges = checkpoint.joined(first, second)
    except InputError as error:
        raise InputError(f"{args.first}, {args.second}: {error}") from None

    runtime.init("cpu", facts["precision"])
    film, other = (film_of(facts, values, done) for values, done in ((arrays, first), (other_arrays, second)))
    film.merge(other)
    if is_picture:
        shown = display if facts["srgb"] else Display()
        image = film.own_pixels(film.image())
        save_image(output, image, srgb=facts["srgb"], exposure=shown.exposure, tone=shown.tone)
    else:
        checkpoint.write_checkpoint(output, {"samples": ranges, **facts}, film.to_arrays())
    print(f"{output}: {film.samples} spp, error {film.error()}, samples {checkpoint.show_ranges(ranges)}")
    if film.non_finite > 0:
        note(f"{film.non_finite} samples were not finite, not added")
    return 0


def film_of(facts: dict, arrays: dict, ranges: list[list[int]]) -> Film:
    """The film that a checkpoint holds."""
    sampler = PARTS.find("sampler", facts["sampler"])
    film = Film(*facts["size"], facts["crop"], sampler.replicated, doubles=sampler.doubles)
    film.from_arrays(arrays, sum(end - start for start, end in ranges))
    return film
