"""Add the samples of several checkpoints of one picture."""

from argparse import Namespace
from pathlib import Path

from taichi_tracer.apps.commands.render import note_linear
from taichi_tracer.apps.console import Parser, note
from taichi_tracer.files.disk import check_place
from taichi_tracer.files.images import check_writable, save_image
from taichi_tracer.picture.checkpoint import (
    EXTENSION,
    SHARES,
    check_same,
    read_checkpoint,
    show_ranges,
    write_checkpoint,
)
from taichi_tracer.picture.film import Film
from taichi_tracer.settings import ADVICE, DISPLAY, add_options
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import PARTS
from taichi_tracer.tones.display import Display


def add_arguments(parser: Parser) -> None:
    """Add what ``merge`` takes."""
    parser.add_argument("files", metavar="FILE", nargs="+", help="checkpoints with other samples of the same picture")
    parser.add_argument("-o", "--output", metavar="C", required=True, help="NAME.checkpoint, or picture, to write")
    add_options(parser, ADVICE, DISPLAY)


def run(args: Namespace) -> int:
    """Add checkpoints; write a checkpoint, or a picture if the ending is one of a picture's."""
    if len(args.files) < 2:
        raise InputError(f"merge: give two checkpoints or more, not only {args.files[0]}")
    output, display = Path(args.output), Display(args.exposure, args.tone)
    is_picture = output.suffix != EXTENSION
    if is_picture:
        check_writable(output)
        note_linear(display, [output])
    else:
        check_place(output)
    facts, ranges, film = {}, [], None
    for path in args.files:
        own, arrays = read_checkpoint(path)
        samples = own.pop("samples")
        facts = facts or own
        check_same(path, own, args.files[0], facts)
        if SHARES in arrays:
            raise InputError(f"{path}: its pixels have different numbers of samples: render it with --no-adaptive")
        ranges = joined(ranges, samples, path)
        runtime.init("cpu", facts["precision"])
        added = film_of(facts, arrays, samples)
        if film is None:
            film = added
        else:
            film.merge(added)
    if is_picture:
        shown = display if facts["srgb"] else Display()
        image = film.own_pixels(film.image())
        save_image(output, image, srgb=facts["srgb"], exposure=shown.exposure, tone=shown.tone)
    else:
        write_checkpoint(output, {"samples": ranges, **facts}, film.to_arrays())
    print(f"{output}: {film.samples} spp, error {film.error()}, samples {show_ranges(ranges)}")
    if film.non_finite > 0:
        note(f"{film.non_finite} samples were not finite, not added")
    return 0


def film_of(facts: dict, arrays: dict, ranges: list[list[int]]) -> Film:
    """The film that a checkpoint holds."""
    sampler = PARTS.find("sampler", facts["sampler"])
    film = Film(*facts["size"], facts["crop"], sampler.replicated, doubles=sampler.doubles)
    film.from_arrays(arrays, sum(end - start for start, end in ranges))
    return film


def joined(before: list[list[int]], added: list[list[int]], path: str) -> list[list[int]]:
    """All ranges of both lists in ascending order; ranges that touch are joined.

    Raises:
        InputError: a sample of the file with the ranges ``added`` is in both lists.
    """
    ranges: list[list[int]] = []
    for start, end in sorted([*before, *added]):
        if ranges and start < ranges[-1][1]:
            both = f"{start} to {min(end, ranges[-1][1]) - 1}"
            raise InputError(f"{path}: samples {both} are in another file, too: each may count once")
        if ranges and start == ranges[-1][1]:
            ranges[-1][1] = end
        else:
            ranges.append([start, end])
    return ranges
