"""Write a part of your own to begin with, such as a BRDF or a camera."""

import keyword
import shlex
from argparse import Namespace
from pathlib import Path

from taichi_tracer.apps.console import Parser
from taichi_tracer.files.disk import replace_file
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.parts import PARTS

FOLDER = Path(__file__).parents[1] / "skeletons"
# Kind → the words of ``render`` that show a part; NAME stands for its name.
SHOWN = {
    "brdf": "cornell_box --estimator mis",
    "light": "cube --estimator mis --lights NAME",
    "integrator": "cornell_box --estimator NAME",
    "view": "cube --view NAME",
    "sampler": "cornell_box --estimator mis --sampler NAME",
    "camera": "cornell_box --estimator mis --camera NAME --fov 120",
    "triangle_test": "cube --view normal --triangle-test NAME",
    "intersector": "cube --view normal --intersector NAME",
    "environment": "specular_spheres --estimator mis --environment NAME",
    "tone": "cornell_box --estimator mis --tone NAME",
}
# Kind → its name in the registry, where that is another one.
KINDS = {"brdf": "BRDF", "view": "integrator", "triangle_test": "triangle test", "tone": "tone curve"}


def add_arguments(parser: Parser) -> None:
    """Add what ``new-part`` takes."""
    kinds = "brdf, light, integrator, view, sampler, camera, triangle_test, intersector, environment, tone"
    parser.add_argument("kind", metavar="KIND", help=kinds)
    parser.add_argument("name", metavar="NAME", help="of the part: letters, digits and _")
    parser.add_argument("-o", "--output", metavar="FILE", default="my_parts.py", help="(default: my_parts.py)")


def run(args: Namespace) -> int:
    """Write the file, and print the commands that check and show the part."""
    if args.kind not in SHOWN:
        raise one_of("kind of part", args.kind, SHOWN)
    if not args.name.isidentifier() or not args.name.isascii() or keyword.iskeyword(args.name):
        raise InputError(f"new-part: {args.name!r} is no name: it has letters, digits and _, and begins with a letter")
    if args.name in PARTS.names(KINDS.get(args.kind, args.kind)):
        raise InputError(f"new-part: the package has a {args.kind} called {args.name}: give yours another name")
    target = Path(args.output).expanduser()
    if target.exists():
        raise InputError(f"new-part: {args.output} is there already: give another name with -o")
    if target.suffix != ".py":
        raise InputError(f"new-part: {args.output} must end with .py")
    replace_file(target, text_of(args.kind, args.name).encode())
    file = shlex.quote(args.output)
    words = SHOWN[args.kind].replace("NAME", args.name)
    print(args.output)
    print(f"  taichi-tracer check-part {file}")
    print(f"  taichi-tracer render {words} --parts {file} --spp 16 -o {args.name}.png")
    return 0


def text_of(kind: str, name: str) -> str:
    """The text of a part."""
    text = (FOLDER / f"{kind}.py").read_text(encoding="utf-8")
    words = "".join(word.capitalize() for word in name.split("_"))
    label = name.replace("_", " ").capitalize()
    return text.replace('"Mine"', f'"{label}"').replace('"mine"', f'"{name}"').replace("Mine", words or "Mine")
