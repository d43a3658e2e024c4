"""Add the samples of several checkpoints of one picture."""

from argparse import Namespace
from pathlib import Path

from taichi_tracer.apps.commands.render import note_linear
from taichi_tracer.apps.console import Parser, note
from taichi_tracer.files import checkpoint
from taichi_tracer.files.disk import check_place
from taichi_tracer.files.images import ENCODERS, check_writable, save_image
from taichi_tracer.picture.checkpoint import SHARES
from taichi_tracer.picture.film import Film
from taichi_tracer.settings import ADVICE, DISPLAY, add_options
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import PARTS
from taichi_tracer.tones.display import Display


def add_arguments(parser: Parser) -> None:
    """Add what ``merge`` takes."""
    parser.add_argument("files", metavar="FILE", nargs="+", help="checkpoints with other samples of the same picture")
    parser.add_argument("-o", "--output", metavar="C", required=True, help="checkpoint, or picture, to write")
    add_options(parser, ADVICE, DISPLAY)


def run(args: Namespace) -> int:
    """Add checkpoints; write a checkpoint, or a picture if the ending is one of a picture's."""
    if len(args.files) < 2:
        raise InputError(f"merge: give two checkpoints or more, not only {args.files[0]}")
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
    facts, ranges, contents = read_all(args.files)
    runtime.init("cpu", facts["precision"])
    film, *others = [film_of(facts, arrays, samples) for arrays, samples in contents]
    for other in others:
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


def read_all(files: list[str]) -> tuple[dict, list[list[int]], list[tuple[dict, list[list[int]]]]]:
    """The facts of the picture, the ranges of all samples, and the arrays and ranges of each file.

    Raises:
        InputError: the files do not fit together.
    """
    facts, _ = checkpoint.read_checkpoint(files[0])
    del facts["samples"]
    ranges: list[list[int]] = []
    contents = []
    for path in files:
        own, arrays = checkpoint.read_checkpoint(path)
        samples = own.pop("samples")
        checkpoint.check_same(path, own, files[0], facts)
        if SHARES in arrays:
            raise InputError(f"{path}: its pixels have different numbers of samples: render it with --no-adaptive")
        try:
            ranges = checkpoint.joined(ranges, samples)
        except InputError as error:
            raise InputError(f"{', '.join(files)}: {error}") from None
        contents.append((arrays, samples))
    return facts, ranges, contents


def film_of(facts: dict, arrays: dict, ranges: list[list[int]]) -> Film:
    """The film that a checkpoint holds."""
    sampler = PARTS.find("sampler", facts["sampler"])
    film = Film(*facts["size"], facts["crop"], sampler.replicated, doubles=sampler.doubles)
    film.from_arrays(arrays, sum(end - start for start, end in ranges))
    return film
