"""Turn the camera about the scene, into a film.

Each frame has the bits of the picture that ``render`` makes from the same point.
"""

import io
import math
import tempfile
import time
from argparse import Namespace
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

from taichi_tracer.apps.commands.render import RendersElsewhere, add_samples, describe, encoding_of, load_scene
from taichi_tracer.apps.console import CLUSTER, Parser, add_cluster_option, load, note
from taichi_tracer.apps.pictures import request_of
from taichi_tracer.apps.running import Interruption, written, written_bytes
from taichi_tracer.camera_controller import Pose, rotate
from taichi_tracer.files.disk import check_place, make_folder
from taichi_tracer.files.images import save_image, to_bytes
from taichi_tracer.settings import DISPLAY, OF_PICTURE, OF_SCENE, TARGET, RenderSettings, add_scene
from taichi_tracer.system.argument_types import at_least_one, number, positive
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.importing import import_extra
from taichi_tracer.tones.display import Display

VIDEO = 'pip install "taichi_tracer[video]"'
QUALITY = 8  # of a film, from 0 to 10


def add_arguments(parser: Parser) -> None:
    """Add what ``turntable`` takes."""
    add_scene(parser, *OF_SCENE, *OF_PICTURE, DISPLAY, TARGET)
    add_cluster_option(parser, "take the samples")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        default="turntable.gif",
        help="FILE.gif, FILE.mp4 (with the extra 'video'), or a folder for one picture a frame (default: %(default)s)",
    )
    parser.add_argument(
        "--frames", type=at_least_one, metavar="N", default=60, help="how many pictures (default: %(default)s)"
    )
    parser.add_argument(
        "--degrees",
        type=number,
        metavar="D",
        default=360.0,
        help="how far the camera turns about its upward direction, at the point looked at (default: %(default)g)",
    )
    parser.add_argument(
        "--fps", type=positive, metavar="F", default=20.0, help="frames per second of the film (default: %(default)g)"
    )


def run(args: Namespace, elsewhere: RendersElsewhere | None = None) -> int:
    """Render the frames and write them; after Ctrl-C, those that are done.

    Args:
        elsewhere: who takes the samples on other machines; None takes them here.
    """
    if args.cluster is not None and elsewhere is None:
        return load(CLUSTER)(args, run)
    request = request_of(RenderSettings.of(args))
    picture, output = request.single("turntable"), Path(args.output)
    check_output(output)
    scene, before = load_scene(request, args.started)
    renderer = picture.make_renderer(scene)
    frames, count, place = [], 0, output
    with Interruption() as interruption:
        for k, eye in enumerate(eyes_of(Pose.of(renderer.camera), args.frames, args.degrees)):
            render = renderer.render if elsewhere is None else elsewhere(renderer, 0)
            renderer.camera.set_camera_parameters(eye=tuple(eye.tolist()))
            renderer.reset()
            add_samples(renderer, picture.target, interruption, render)
            image = renderer.film.own_pixels(renderer.image())
            if interruption.number is not None:
                break
            encoding, count = encoding_of(renderer, picture), k + 1
            if is_folder(output):
                name = f"frame_{k:0{len(str(args.frames - 1))}d}.png"
                written(output / name, partial(save_image, image=image, **encoding))
            else:
                display = Display(encoding["exposure"], encoding["tone"])
                frames.append(to_bytes(image, encoding["srgb"], display))
            print(f"frame {count} of {args.frames}: {describe(renderer, image)}", flush=True)
    if frames:
        place = written_bytes(output, FILMS[output.suffix.lower()](frames, args.fps))
    if count > 0:
        print(f"{place}: {count} frames ({before}, total {time.perf_counter() - args.started:.2f} s)")
    if interruption.number is not None:
        note(f"{interruption.word} after {count} of {args.frames} frames")
        return interruption.exit_code
    return 0


def check_output(output: Path) -> None:
    """Raise an InputError unless the film can be written there later."""
    if is_folder(output):
        make_folder(output, f"-o {output}")
        return
    if output.suffix.lower() not in FILMS:
        raise InputError(f"-o {output}: a film is .gif or .mp4, or a folder without an ending takes the frames")
    check_place(output)
    if output.suffix.lower() == ".mp4":
        encoder()


def is_folder(output: Path) -> bool:
    """Whether each frame is a file of its own."""
    return output.suffix == "" or output.is_dir()


def eyes_of(pose: Pose, count: int, degrees: float) -> list[np.ndarray]:
    """(3,) where the eye is in each frame; a whole turn ends one step before it began."""
    up = pose.up / np.linalg.norm(pose.up)
    angles = np.arange(count) * math.radians(degrees) / count
    return [pose.at + rotate(pose.eye - pose.at, up, float(angle)) for angle in angles]


# ── films ──


def gif_of(frames: list[np.ndarray], fps: float) -> bytes:
    """A GIF, which is shown again and again."""
    first, *others = map(Image.fromarray, frames)
    content = io.BytesIO()
    first.save(content, "GIF", save_all=True, append_images=others, duration=1000 / fps, loop=0)
    return content.getvalue()


def mp4_of(frames: list[np.ndarray], fps: float) -> bytes:
    """An MP4 (H.264). A picture with an odd side is enlarged to an even one."""
    height, width = frames[0].shape[:2]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder, "film.mp4")
        film = encoder().write_frames(str(place), (width, height), fps=fps, quality=QUALITY, macro_block_size=2)
        film.send(None)
        for frame in frames:
            film.send(np.ascontiguousarray(frame))
        film.close()
        return place.read_bytes()


def encoder():
    """The module that writes films; an InputError if it is not installed."""
    return import_extra(
        "imageio_ffmpeg", f".mp4 needs imageio-ffmpeg: {VIDEO}, or write a .gif, or the frames into a folder"
    )


FILMS = {".gif": gif_of, ".mp4": mp4_of}
