"""The command line: what can be typed, and how errors are told. Each command lives in a module of its own.

Nothing here imports Taichi: ``--help`` and ``--version`` answer at once, and a command loads what it needs.
"""

import argparse
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Sequence

import taichi_tracer
from taichi_tracer.apps.interruption import EXIT_CODE
from taichi_tracer.apps.words import (
    LIGHT,
    PICTURE_FOLDER,
    PICTURE_SIZE,
    SMOOTH,
    USER_ERROR,
    OneOfOptions,
    as_value,
    at_least_one,
    bounces,
    degrees,
    let_every_character_print,
    names,
    note,
    number,
    positive,
    size,
    told,
    values_of,
    whole,
    wholes,
)
from taichi_tracer.system import clock, leftovers
from taichi_tracer.system.errors import InputError, StaleSceneError

CLUSTER = "taichi_tracer.cluster.command"  # what runs a command where --cluster is given


def main(argv: list[str] | None = None) -> int:
    """Run one command; returns the exit code: 0, 2 when the input cannot be used, 130 when Ctrl-C was pressed.

    Args:
        argv: the words after the program's name; those of this process when None.
    """
    warnings.showwarning = show_warning
    let_every_character_print()
    told.clear()
    words = [as_value(word) for word in (sys.argv[1:] if argv is None else argv)]
    parts = values_of("--parts", words)
    started = clock.started_at() if argv is None else time.perf_counter()
    try:
        args = make_parser(parts).parse_args(words)
        args.started = started
        is_here = getattr(args, "cluster", None) is None
        args.helper = args.begin() if argv is None and is_here and "begin" in args else None
        load_parts(args.parts)
        return args.command(args)
    except BrokenPipeError:  # the reader of our output has gone, as in "... | head"
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        leftovers.remove()
        print("taichi-tracer: interrupted", file=sys.stderr)
        return EXIT_CODE + signal.SIGINT
    except Exception as error:
        leftovers.remove()
        is_users = isinstance(error, (InputError, StaleSceneError, OSError))
        text = str(error) if is_users else load("faults:told")(error, parts)
        if text is None or "--debug" in words:
            raise
        print(f"taichi-tracer: error: {' '.join(text.split())}", file=sys.stderr)
        return USER_ERROR


def load_parts(paths: Sequence[str]) -> None:
    """Run the files of ``--parts``, once, before any name is looked up."""
    if paths:
        from taichi_tracer.system import registry

        for path in paths:
            registry.load_parts(path)


def show_warning(message, category, *_where, **_more) -> None:
    """What the library warns of, as a line of ours; what other libraries warn of is not the user's to mend."""
    if issubclass(category, UserWarning):
        note(str(message))


class Parser(argparse.ArgumentParser):
    """An ArgumentParser whose errors are ours, and whose help may end with lists of names.

    Attributes:
        lists: which lists, see ``names.LISTS``. Finding the names takes time, so that only a help does it.
        parts: the files of ``--parts``, whose names belong to the lists.
    """

    lists: Sequence[str] = ()
    parts: Sequence[str] = ()

    def error(self, message: str) -> None:
        """Raise instead of printing the whole usage."""
        raise InputError(f"{message} (see: {self.prog} --help)")

    def format_help(self) -> str:
        """The help, and the names that are known now."""
        text = super().format_help()
        if self.lists:
            load_parts(self.parts)
            text += load("names:help_text")(self.lists)
        return text


def make_parser(parts: Sequence[str] = ()) -> Parser:
    """The whole grammar of the command line.

    Args:
        parts: the files of ``--parts``, as far as they are known before the words are parsed: a help lists their names.
    """
    parser = Parser(prog="taichi-tracer", description="A teaching ray tracer: pictures, and questions to a scene.")
    parser.add_argument("--version", action="version", version=f"taichi-tracer {taichi_tracer.__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", parser_class=Parser)

    render = add_command(commands, "render", "write pictures of a scene", "render:run")
    add_render(render)
    runs_on_clusters(render, "render")

    merge = add_command(commands, "merge", "add the samples of two checkpoints of one picture", "merge:run")
    merge.add_argument("first", metavar="A", help="checkpoint")
    merge.add_argument("second", metavar="B", help="checkpoint with other samples of the same picture")
    merge.add_argument("-o", "--output", metavar="C", required=True, help="checkpoint, or picture, to write")
    add_parts_option(merge)
    add_display_options(merge)
    merge.lists = ("samplers", "tones")

    view = add_command(commands, "view", "open the interactive window", "viewer:run")
    add_scene_options(view)
    add_picture_options(view)
    add_display_options(view)
    view.add_argument("--browser", action="store_true", help="serve the picture to a browser on this machine instead")
    view.lists = ("pictures", "tones", "scenes")

    export = add_command(commands, "export", "write a scene and its camera as RT3 XML", "export:run")
    add_scene_argument(export)
    export.add_argument("output", metavar="OUT.xml", help="file to write; the meshes stand in it, number by number")
    add_parts_option(export)
    add_picture_options(export)
    export.lists = ("pictures", "files")

    info = add_command(commands, "info", "what a scene is made of, and which code a picture of it runs", "info:run")
    add_scene_options(info)
    add_picture_options(info)
    info.lists = ("pictures", "scenes")

    effects = add_command(
        commands, "effects", "what each effect costs, and what the scene saves without it", "effects:run"
    )
    add_scene_options(effects)
    effects.add_argument(
        "--estimator", default="brdf", metavar="NAME", help="how light is sampled (default: %(default)s)"
    )
    effects.add_argument("--size", type=size, default=PICTURE_SIZE, metavar="WxH", help="pixels (default: %(default)s)")
    effects.add_argument("--sampler", metavar="NAME", help="where random numbers come from")
    add_camera_options(effects)
    effects.lists = ("estimators", "samplers", "cameras", "scenes")

    add_explain(add_command(commands, "explain", "every number on the way from one pixel to its colour", "explain:run"))

    accuracy = add_command(commands, "accuracy", "what accuracy costs in time", "accuracy:run")
    add_accuracy(accuracy)
    runs_on_clusters(accuracy, "accuracy")

    add_samples(add_command(commands, "samples", "where samples of the light go", "samples:run"))

    add_compare(add_command(commands, "compare", "how different two pictures are", "compare:run"))

    what = "do hard cases stay numerically stable, and what does that cost"
    add_hardcases(add_command(commands, "hardcases", what, "hardcases:run"))

    add_assignment(
        add_command(commands, "assignment", "hand out an assignment of the teaching kit", "assignment:list_all")
    )
    add_check(add_command(commands, "check", "check your own solution of an assignment", "check:run"))
    grade = add_command(commands, "grade", "grade the submissions of an assignment", "grade:run")
    add_grade(grade)
    runs_on_clusters(grade, "grade")

    add_command(commands, "doctor", "what works on this machine, and what would mend the rest", "doctor:run")
    for command in commands.choices.values():
        command.parts = parts
    return parser


def add_compare(parser: Parser) -> None:
    """What ``compare`` takes."""
    parser.add_argument("first", metavar="A", help="picture: .exr .hdr .pfm .npy .png .jpg")
    parser.add_argument("second", metavar="B", help="picture of the same size, by which A is measured")
    parser.add_argument("--report", metavar="FILE", help="page to write, .html, with both and where they differ")
    parser.add_argument("--tolerance", type=positive, metavar="PERCENT", help="exit with 1 if they differ by more")
    parser.add_argument("--data", action="store_true", help="PNG and JPEG hold data, such as normals: not sRGB")


def add_hardcases(parser: Parser) -> None:
    """What ``hardcases`` takes."""
    size_of = parser.add_mutually_exclusive_group()
    parser.set_defaults(level="default")
    for name, what in (("quick", "within a minute"), ("full", "for an hour, with 1e8 rays at edges for every mode")):
        size_of.add_argument(f"--{name}", dest="level", action="store_const", const=name, help=what)
    parser.add_argument("--json", metavar="FILE", help="write what was found as JSON, too")
    parser.add_argument(
        "--report", metavar="DIR", help="write a page with tables, charts and leak maps into a folder, too"
    )
    add_parts_option(parser)
    parser.lists = ("rays", "surfaces")


def add_assignment(parser: Parser) -> None:
    """What ``assignment list`` and ``assignment new`` take."""
    kinds = parser.add_subparsers(title="what", required=True, metavar="list|new", parser_class=Parser)
    add_command(kinds, "list", "list the assignments that come with the package", "assignment:list_all")
    new = add_command(kinds, "new", "write the folder that a student gets", "assignment:new")
    new.add_argument("assignment", metavar="NAME|FOLDER", help="a1, a2, a3, a4, rt3, or the folder of your own")
    new.add_argument("folder", metavar="DIR", help="folder to write; it must be empty or not exist")
    new.add_argument("--solution", action="store_true", help="write the solved one, for teachers")
    new.add_argument("--notebook", action="store_true", help="write one notebook instead of Python files")
    new.add_argument("--seed", type=whole, default=0, metavar="N", help="of the inputs of the checks (default: 0)")


def add_grade(parser: Parser) -> None:
    """What ``grade`` takes."""
    parser.add_argument("assignment", metavar="NAME|FOLDER", help="a1, a2, a3, a4, rt3, or the folder of your own")
    parser.add_argument(
        "path",
        metavar="SUBMISSION.zip|FOLDER",
        help="one student's zip file or folder, or a folder with one of them for each student, called <9-digit id>.zip",
    )
    parser.add_argument(
        "--jobs", type=at_least_one, default=1, metavar="N", help="submissions at the same time (default: %(default)s)"
    )
    parser.add_argument("--weights", metavar="FILE", help="points and rules of the course, .json: docs/grading.md")
    parser.add_argument(
        "--seed", type=whole, default=1, metavar="N", help="of the inputs; keep it to yourself (default: %(default)s)"
    )
    parser.add_argument(
        "--level",
        choices=("bwrap", "unshare", "landlock", "limits"),
        help="walls around each submission (default: the strongest that this machine has, see doctor)",
    )
    parser.add_argument("--anew", action="store_true", help="grade again what was graded before")
    add_cluster_option(parser, "grade the zip files of an assignment that comes with the package")
    written = parser.add_argument_group("what is written")
    written.add_argument("--json", action="store_true", help="print everything as JSON")
    written.add_argument("--csv", metavar="FILE", help="a table with a row for each student")
    written.add_argument("--gradescope", metavar="FILE", help="results.json of one student, for Gradescope")
    written.add_argument("--report", metavar="DIR", help="a page of the class, and one for each student")
    written.add_argument(
        "--gradescope-upload",
        dest="upload",
        action="store_true",
        help="grade nothing, but write the autograder of NAME as the second file, OUT.zip",
    )


def add_check(parser: Parser) -> None:
    """What ``check`` takes."""
    parser.add_argument(
        "folder", metavar="DIR", nargs="?", default=".", help="that assignment new wrote (default: here)"
    )
    parser.add_argument("names", metavar="PART", nargs="*", help="only these: a method, a class or a picture")
    parser.add_argument("--seed", type=whole, metavar="N", help="of the inputs (default: that of the folder)")
    parser.add_argument("--report", metavar="FILE", help="page to write (default: DIR/check.html)")


def add_cluster_option(parser: Parser, what: str) -> None:
    """Where the work is done, instead of here."""
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help=f"{what} on the workers of a Dask cluster that runs, tcp://host:8786 or tls://host:8786, or on local:N "
        "processes of this machine; see docs/cluster.md",
    )


def runs_on_clusters(parser: Parser, name: str) -> None:
    """Let a command that has the option run on a cluster where it is given."""
    parser.set_defaults(command=lambda args: load(f"{name}:run" if args.cluster is None else f"{CLUSTER}:{name}")(args))


def add_render(parser: Parser) -> None:
    """What ``render`` takes."""
    add_scene_options(parser)
    add_picture_options(parser)
    add_display_options(parser)
    parser.add_argument(
        "--bounces",
        type=bounces,
        default=(),
        metavar="LIST",
        help="one picture for the light after each of these numbers of bounces, such as 0,1,2,3+ or 0,1-4, and one "
        "with all of them side by side: FILE_bounce_0.png ..., FILE_bounces.png",
    )
    targets = parser.add_argument_group(
        "when to stop", "at the first that is reached; else the samples of the scene file, or 1"
    )
    targets.add_argument("--spp", type=at_least_one, metavar="N", help="samples per pixel")
    targets.add_argument("--time", type=positive, metavar="SECONDS", help="seconds of rendering, without compiling")
    targets.add_argument("--error", type=positive, metavar="PERCENT", help="estimated relative RMSE of the picture")
    targets.add_argument("--adaptive", action="store_true", help="more samples where the error is larger")
    keeping = parser.add_argument_group("stopping and going on")
    keeping.add_argument("--checkpoint", metavar="FILE", help="keep the samples there, and go on from it if it exists")
    keeping.add_argument(
        "--checkpoint-every", type=positive, default=30, metavar="SECONDS", help="how often (default: %(default)s)"
    )
    keeping.add_argument(
        "--first-sample",
        type=whole,
        metavar="K",
        help="index of the first sample, to render parts elsewhere (default: %(default)s)",
    )
    add_cluster_option(parser, "take the samples")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="picture to write, or a folder; its ending says the format (default: the scene file's, or "
        f"{PICTURE_FOLDER}/SCENE_VIEW.png)",
    )
    parser.add_argument(
        "--aov",
        type=names,
        default=(),
        metavar="A,B",
        help="raw arrays that an .exr file has beside the picture, such as the distance: names with commas",
    )
    parser.add_argument(
        "--profile",
        action="store_true",
        help="tell where the time goes, from the start of Python to the file, in a table and in FILE.profile.html",
    )
    parser.lists = ("pictures", "tones", "aovs", "scenes")


def add_explain(parser: Parser) -> None:
    """What ``explain`` takes."""
    add_scene_options(parser)
    add_picture_options(parser)
    which = parser.add_argument_group("which pixel", "one of --pixel, --worst and --non-finite")
    which.add_argument(
        "--pixel", type=whole, nargs=2, metavar=("X", "Y"), help="column from the left and row from the top, from 0"
    )
    which.add_argument("--worst", action="store_true", help="the pixel with the largest standard error")
    which.add_argument("--non-finite", action="store_true", help="the first sample that is infinite or not a number")
    which.add_argument("--sample", type=whole, default=0, metavar="K", help="which sample of it (default: %(default)s)")
    which.add_argument(
        "--spp", type=at_least_one, metavar="N", help="samples per pixel (default: the scene file's, or 1)"
    )
    parser.add_argument("--json", metavar="FILE", help="write all steps as JSON, too")
    parser.add_argument("--html", metavar="FILE", help="write a page with drawings, too")
    parser.lists = ("pictures", "scenes")


def start_worker():
    """The first process of a study, which reads its modules while this one reads its own."""
    from taichi_tracer.studies.crew import Worker

    return Worker()


def add_accuracy(parser: Parser) -> None:
    """What a study of accuracy compares, and for how long."""
    parser.set_defaults(begin=start_worker)
    add_scene_argument(parser)
    add_parts_option(parser)
    add_light_options(parser, f"or none (default: the scene's own light, or {LIGHT} where it has none)")
    add_surface_options(parser, names_lamp_choice=False)
    knobs = parser.add_argument_group("what is compared", "names with commas, or all; those with a star if not given")
    for name in ("estimators", "samplers", "precisions", "intersectors", "triangle-tests", "lookups", "forms"):
        keyword = name.replace("-", " ")
        knobs.add_argument(f"--{name}", type=names, metavar="A,B", help=f"which {keyword}")
    knobs.add_argument("--fast-math", choices=("off", "on", "both"), help="default: both")
    knobs.add_argument("--every", action="store_true", help="every combination, not each knob alone")
    one = parser.add_argument_group(
        "questions",
        "with several values of one of these, the other knobs that are not named keep their first value, and the "
        "estimator is path, or mis for choices of lamps alone",
    )
    one.add_argument("--lamp-choices", type=names, metavar="A,B", help="how a sample chooses among lamps")
    one.add_argument(
        "--max-bounces",
        type=wholes,
        metavar="A,B",
        help="how many surfaces may reflect on a path; the largest is that of the reference (default: 5)",
    )
    one.add_argument(
        "--roulettes",
        type=names,
        metavar="A,B",
        help="none, throughput, or the probability q with which the course's roulette ends a path: 0.2,0.5",
    )
    one.add_argument("--rr-start-bounce", type=whole, metavar="N", help="after so many, it may end a path (default: 3)")
    parser.add_argument("--size", type=size, default="128x128", metavar="WxH", help="pixels (default: %(default)s)")
    parser.add_argument(
        "--seeds", type=at_least_one, default=3, metavar="N", help="renderings of each (default: %(default)s)"
    )
    parser.add_argument("--budget", type=positive, default=60, metavar="SECONDS", help="in all (default: %(default)s)")
    parser.add_argument("--report", metavar="DIR", help="folder for a page, a chart, CSV and JSON")
    parser.add_argument("--arch", metavar="NAME", help="which backend runs the kernels")
    add_cluster_option(parser, "take the measurements")
    add_camera_options(parser)
    parser.lists = ("knobs", "cameras", "surfaces", "files", "archs")


def add_samples(parser: Parser) -> None:
    """What is sampled, and how often."""
    parser.add_argument(
        "what",
        metavar="ENVIRONMENT|SCENE",
        help="an environment: uniform directions against importance sampling; or a scene with lamps: which of them are "
        "chosen from a point",
    )
    add_parts_option(parser)
    parser.add_argument(
        "--count", type=at_least_one, default=1_000_000, metavar="N", help="samples of each (default: %(default)s)"
    )
    parser.add_argument(
        "--size", type=size, default="256x128", metavar="WxH", help="cells of the maps (default: %(default)s)"
    )
    parser.add_argument("--seed", type=whole, default=0, metavar="S", help="of the random numbers (default: 0)")
    parser.add_argument(
        "--point", type=number, nargs=3, metavar=("X", "Y", "Z"), help="that is lit (default: the middle of the view)"
    )
    parser.add_argument(
        "--normal", type=number, nargs=3, metavar=("X", "Y", "Z"), help="there (default: that of the surface, or up)"
    )
    parser.add_argument(
        "-o", "--output", default=PICTURE_FOLDER, metavar="DIR", help="folder for the pictures (default: %(default)s)"
    )
    parser.lists = ("files",)


def add_command(commands: argparse._SubParsersAction, name: str, what: str, target: str) -> Parser:
    """A command that runs ``module:function`` of this folder with the parsed arguments."""
    parser = commands.add_parser(name, help=what, description=what[0].upper() + what[1:] + ".")
    parser.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help="show the traceback of errors")
    parser.set_defaults(command=lambda args: load(target)(args), parts=[])
    return parser


def load(target: str) -> Callable:
    """The function that "module:function" names, its module imported only now; one without dots is in this folder."""
    from taichi_tracer.system.importing import import_quickly

    module, function = target.split(":")
    return getattr(import_quickly(module if "." in module else f"taichi_tracer.apps.{module}"), function)


def add_scene_argument(parser: Parser) -> None:
    """The scene alone, and which way it stands."""
    what = "name of a shipped scene, or a file: .obj .ply .stl .glb ..., or .xml of RT3"
    parser.add_argument("scene", metavar="SCENE", help=what)
    parser.add_argument(
        "--up-axis",
        default="y",
        metavar="y|z",
        help="which axis of the scene points upwards: the view of a mesh, and the zenith of the environment, follow it "
        "(default: %(default)s)",
    )


def add_parts_option(parser: Parser) -> None:
    """The files of parts of one's own."""
    parser.add_argument(
        "--parts",
        action="append",
        metavar="FILE.py",
        help="run a Python file that registers parts of your own by @tt.register: their names can then be given as "
        "those of the package; may be given several times",
    )


def add_scene_options(parser: Parser) -> None:
    """The scene, how its rays are intersected, and where that runs."""
    add_scene_argument(parser)
    add_parts_option(parser)
    light = add_light_options(parser, f"or none (default: the scene file's, or {LIGHT} where light is asked for)")
    light.add_argument("--lookup", metavar="NAME", help="nearest texel of the environment, or bilinear")
    add_surface_options(parser)
    parser.add_argument(
        "--smooth",
        nargs="?",
        type=degrees,
        const=SMOOTH,
        metavar="DEGREES",
        help="smooth normals where the file has none; edges that bend by more stay sharp (default of DEGREES: "
        f"{SMOOTH:g})",
    )
    parser.add_argument("--effects", metavar="scene|all", help="compile what the scene calls for, or everything")
    rays = parser.add_argument_group("how rays are intersected")
    rays.add_argument("--intersector", metavar="NAME", help="which intersector finds what a ray meets")
    rays.add_argument("--triangle-test", metavar="NAME", help="which ray-triangle test it uses")
    rays.add_argument(
        "--plain",
        action="store_true",
        help="run only the plain forms, which are there to be read; same bits, more time",
    )
    machine = parser.add_argument_group("where it runs")
    machine.add_argument("--arch", metavar="NAME", help="which backend runs the kernels")
    machine.add_argument("--precision", metavar="NAME", help="of every coordinate and colour")
    machine.add_argument("--fast-math", action="store_true", help="let the compiler round and treat NaN freely")


def add_light_options(parser: Parser, otherwise: str) -> argparse._ArgumentGroup:
    """The environment; ``otherwise`` says what it is when it is not given."""
    light = parser.add_argument_group("light from far away")
    what = f"a shipped name, an image (.hdr .exr .png .jpg .npy), {otherwise}"
    light.add_argument("--environment", metavar="E", help=what)
    light.add_argument("--intensity", type=number, metavar="X", help="multiply its radiance")
    light.add_argument("--rotation", type=number, metavar="D", help="turn it about the upward axis by degrees")
    return light


def add_surface_options(parser: Parser, names_lamp_choice: bool = True) -> None:
    """BRDFs and lights by name; and one choice of lamps, unless a command compares several."""
    surfaces = parser.add_argument_group("surfaces and lights", "names with commas")
    surfaces.add_argument(
        "--brdfs",
        type=names,
        default=(),
        metavar="A,B",
        help="BRDFs that are asked first whether a material is theirs",
    )
    surfaces.add_argument(
        "--lights", type=names, default=(), metavar="A,B", help="lights of the scene, beside its environment"
    )
    if names_lamp_choice:
        surfaces.add_argument(
            "--lamp-choice", metavar="NAME", help="how a sample chooses among the surfaces with Ke > 0 (one name)"
        )
    surfaces.add_argument("--two-sided-lamps", action="store_true", help="triangles with Ke > 0 emit from both sides")


def add_picture_options(parser: Parser) -> None:
    """What is shown, how large, and from where."""
    parser.set_defaults(spp=None, adaptive=False, first_sample=0)  # where there is no option for them
    parser.set_defaults(exposure=0.0, tone="none")
    parser.add_argument(
        "--view",
        "--estimator",
        dest="view",
        action=OneOfOptions,
        metavar="NAME",
        help="what to show, or how to sample its light: one name, several with commas, or 'all' (default: the scene "
        "file's, or the one with a star)",
    )
    parser.add_argument(
        "--size", type=size, metavar="WxH", help=f"pixels (default: the scene file's, or {PICTURE_SIZE})"
    )
    parser.add_argument("--quick", action="store_true", help="a quarter of the width and of the height")
    parser.add_argument(
        "--crop",
        type=number,
        nargs=4,
        metavar=("X0", "X1", "Y0", "Y1"),
        help="render only this part of the frame, in fractions of it, y from the bottom",
    )
    parser.add_argument(
        "--max-distance",
        type=positive,
        metavar="UNITS",
        help="the distance that the view 'distance' shows white (default: 10, or a round number that fits the scene)",
    )
    parser.add_argument(
        "--map-of",
        metavar="NAME",
        help="the view, estimator or path whose work a map such as 'nodes' shows (default: path)",
    )
    parser.add_argument("--sampler", metavar="NAME", help="where random numbers come from")
    parser.add_argument(
        "--seed", type=whole, default=0, metavar="S", help="of the random numbers (default: %(default)s)"
    )
    parser.add_argument("--jitter", action="store_true", help="rays through random points of the pixels, in views too")
    add_path_options(parser)
    add_weight_options(parser)
    add_camera_options(parser)


def add_display_options(parser: Parser) -> None:
    """How light is shown on a screen and in files of 8 bits."""
    what = "of light and colour, on the screen and in .png .jpg .ppm; other files, errors and comparisons stay linear"
    display = parser.add_argument_group("how it is shown", what)
    display.add_argument(
        "--exposure", type=number, default=0.0, metavar="STOPS", help="each doubles the light (default: %(default)g)"
    )
    display.add_argument("--tone", default="none", metavar="NAME", help="curve that bends bright values below white")


def add_path_options(parser: Parser) -> None:
    """How long paths are."""
    paths = parser.add_argument_group("paths", "for implicit, explicit and path, on which light bounces")
    paths.add_argument("--max-bounces", type=whole, metavar="N", help="how many surfaces may reflect (default: 5)")
    paths.add_argument(
        "--rr-start-bounce", type=whole, metavar="N", help="after so many, roulette may end a path (default: 3)"
    )
    paths.add_argument(
        "--rr-termination-probability", type=number, metavar="Q", help="with which it ends a path (default: 0)"
    )
    paths.add_argument(
        "--roulette", metavar="NAME", help="course: the constant Q (default); throughput: dark paths end first"
    )


def add_weight_options(parser: Parser) -> None:
    """How often ``mis_one_sample`` takes which direction."""
    weights = parser.add_argument_group(
        "weights", "of the two directions among which mis_one_sample draws lots; their sum counts as 1"
    )
    weights.add_argument("--mis-plight", type=number, metavar="W", help="one to a light (default: 0.5)")
    weights.add_argument("--mis-pbrdf", type=number, metavar="W", help="one from the BRDF (default: 0.5)")


def add_camera_options(parser: Parser) -> None:
    """From where the scene is seen."""
    camera = parser.add_argument_group("camera", "what is not given is the scene's own")
    for name, what in (("eye", "position"), ("at", "point looked at"), ("up", "which way is up")):
        camera.add_argument(f"--{name}", type=number, nargs=3, metavar=("X", "Y", "Z"), help=what)
    camera.add_argument("--camera", metavar="NAME", help="how it projects")
    camera.add_argument(
        "--window",
        type=number,
        nargs=4,
        metavar=("L", "R", "B", "T"),
        help="left, right, bottom and top of the image plane: at distance 1, or in world units where orthographic",
    )
    camera.add_argument("--fov", type=number, metavar="D", help="vertical field of view in degrees, between 0 and 180")
    camera.add_argument(
        "--handedness",
        metavar="left|right",
        help="left mirrors, as the course does; right shows the scene as a modelling program does",
    )
