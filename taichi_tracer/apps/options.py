"""Every option of a scene and of a picture, in one table: what its words may be, what it means, whose value it is.

A command takes groups of the table (``add_scene_options`` and so on); ``words_of`` makes the words of an option again
from its value. An option that is not given is None unless the table says otherwise, and then the default of the object
that takes the value counts. Nothing here imports Taichi, nor anything else that is large: a help answers at once.
"""

from argparse import ArgumentParser, BooleanOptionalAction
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from taichi_tracer.apps.words import (
    PICTURE_SIZE,
    SMOOTH,
    USUAL_SECONDS,
    USUAL_SPP,
    OneOfOptions,
    at_least_one,
    bounces,
    degrees,
    names,
    number,
    percentage,
    positive,
    size,
    whole,
)
from taichi_tracer.values import (
    BOUNCES,
    MAP_OF,
    MAX_BOUNCES,
    MAX_DISTANCE,
    ROULETTE,
    RR_PROBABILITY,
    RR_START,
    USUAL_LIGHT,
    WEIGHTS,
    Value,
)

XYZ = ("X", "Y", "Z")


class Option(NamedTuple):
    """An option.

    Attributes:
        name: of the value, with underscores; the option has hyphens.
        what: for the help. metavar: its words there; "" is an option without words.
        read: what makes the value of a word. more: further arguments of ``add_argument``.
        default: the value if it is not given.
        part: the kind of registered part that it names.
        value: what it changes of a renderer, see ``values.VALUES``.
    """

    name: str
    what: str
    metavar: str | tuple[str, ...] = "NAME"
    read: Callable[[str], Any] = str
    default: Any = None
    part: str = ""
    value: str = ""
    more: dict[str, Any] = {}

    @property
    def flag(self) -> str:
        """The option as it is written."""
        return f"--{self.name.replace('_', '-')}"


def of_value(value: Value, metavar: str, read: Callable[[str], Any] = str, name: str = "", default: str = "") -> Option:
    """The option of a value of renderers.

    Args:
        name: where it is not that of the value. default: where its default is not a number, what happens then.
    """
    told = f"{value.what} (default: {default or format(value.default, 'g')})"
    return Option(name or value.name, told, metavar, read, value=value.name)


def vector(name: str, what: str, metavar: tuple[str, ...] = XYZ) -> Option:
    """An option of several numbers."""
    return Option(name, what, metavar, number, more={"nargs": len(metavar)})


def switch(name: str, what: str) -> Option:
    """An option without words."""
    return Option(name, what, "", default=False, more={"action": "store_true"})


class Group(NamedTuple):
    """Options that stand together in a help; without a title, they stand at its beginning."""

    title: str
    what: str
    options: tuple[Option, ...]


UP_AXIS = Option(
    "up_axis",
    "which axis of the scene points upwards: the view of a mesh, and the zenith of the environment, follow it "
    "(default: y, or z for a file that stands on a flat base then)",
    "y|z",
)
PARTS_OPTION = Option(
    "parts",
    "run a Python file that registers parts of your own by @tt.register: their names can then be given as those of the "
    "package; may be given several times",
    "FILE.py",
    more={"action": "append"},
)
COURSE = Option(
    "course",
    "use a student's files of the course in the place of the package's: camera.py, ray_intersector.py, "
    "environment.py, sampler.py, renderer.py",
    "FOLDER",
    more={"action": "append", "dest": "parts"},
)
FAR_LIGHT = Group(
    "light from far away",
    "",
    (
        Option("environment", "a shipped name, an image (.hdr .exr .png .jpg .npy), {otherwise}", "E"),
        Option("intensity", "multiply its radiance (default: 1)", "X", number),
        Option("rotation", "turn it about the upward axis by degrees (default: 0)", "D", number),
    ),
)
LOOKUP = Option("lookup", "nearest texel of the environment, or bilinear (default: nearest)")
LAMP_CHOICE = Option(
    "lamp_choice",
    "how a sample chooses among the surfaces with Ke > 0 (one name; default: power for few, hierarchy for many)",
    part="lamp choice",
)
SURFACES = Group(
    "surfaces and lights",
    "names with commas",
    (
        Option(
            "brdfs",
            "BRDFs that are asked first whether a material is theirs (default: none beside the registered ones)",
            "A,B",
            names,
            (),
            part="BRDF",
        ),
        Option(
            "lights",
            "lights of the scene, beside its environment (default: none but the scene file's)",
            "A,B",
            names,
            (),
            part="light",
        ),
        LAMP_CHOICE,
        switch("two_sided_lamps", "triangles with Ke > 0 emit from both sides"),
    ),
)
COMPILED = Group(
    "",
    "",
    (
        Option(
            "smooth",
            "smooth normals where the file has none; edges that bend by more stay sharp (default of DEGREES: "
            f"{SMOOTH:g})",
            "DEGREES",
            degrees,
            more={"nargs": "?", "const": SMOOTH},
        ),
        switch("ground", "a large diffuse square under everything; what has no material of its own is as grey"),
        Option("effects", "compile what the scene calls for, or everything (default: scene)", "scene|all"),
    ),
)
RAYS = Group(
    "how rays are intersected",
    "",
    (
        Option(
            "intersector",
            "which intersector finds what a ray meets (default: bvh, or wide_bvh for many primitives)",
            part="intersector",
        ),
        Option("triangle_test", "which ray-triangle test it uses (default: watertight)", part="triangle test"),
    ),
)
MACHINE = Group(
    "where it runs",
    "",
    (
        Option("arch", "which backend runs the kernels (default: auto, a GPU where one works, else the CPU)"),
        Option("precision", "of every coordinate and colour (default: f32)"),
        switch("fast_math", "let the compiler round and treat NaN freely"),
    ),
)
PICTURE = Group(
    "",
    "",
    (
        Option("size", f"pixels (default: the scene file's, or {PICTURE_SIZE})", "WxH", size),
        switch("quick", "a quarter of the width and of the height"),
        vector(
            "crop",
            "render only this part of the frame, in fractions of it, y from the bottom (default: 0 1 0 1)",
            ("X0", "X1", "Y0", "Y1"),
        ),
        of_value(MAX_DISTANCE, "UNITS", positive, default="10, or a round number that fits the scene"),
        of_value(MAP_OF, "NAME", name="map_of", default=MAP_OF.default),
        Option(
            "sampler",
            "where random numbers come from (default: niederreiter; niederreiter_two with --adaptive)",
            part="sampler",
        ),
        Option("seed", "of the random numbers (default: %(default)s)", "S", whole, 0),
        switch("jitter", "rays through random points of the pixels, in views too"),
    ),
)
DISPLAY = Group(
    "how it is shown",
    "of light and colour, on the screen and in .png .jpg .ppm; other files, errors and comparisons stay linear",
    (
        Option("exposure", "each doubles the light (default: %(default)g)", "STOPS", number, 0.0),
        Option(
            "tone",
            "curve that bends bright values below white (default: %(default)s)",
            default="none",
            part="tone curve",
        ),
    ),
)
PATHS = Group(
    "paths",
    "for implicit, explicit and path, on which light bounces",
    (
        of_value(MAX_BOUNCES, "N", whole),
        of_value(RR_START, "N", whole),
        of_value(RR_PROBABILITY, "Q", number),
        of_value(ROULETTE, "NAME", default=ROULETTE.default),
    ),
)
BY_BOUNCE = Option(
    "bounces",
    "one picture for the light after each of these numbers of bounces, such as 0,1,2,3+ or 0,1-4, and one with all of "
    "them side by side: FILE_bounce_0.png ..., FILE_bounces.png",
    "LIST",
    bounces,
    (),
    value=BOUNCES.name,
)
MIS = Group(
    "weights",
    "of the two directions among which mis_one_sample draws lots; their sum counts as 1",
    tuple(of_value(value, "W", number) for value in WEIGHTS),
)
CAMERA = Group(
    "camera",
    "what is not given is the scene's own",
    (
        vector("eye", "position"),
        vector("at", "point looked at"),
        vector("up", "which way is up"),
        Option("camera", "how it projects (default: perspective)", part="camera"),
        vector(
            "window",
            "left, right, bottom and top of the image plane: at distance 1, or in world units where orthographic",
            ("L", "R", "B", "T"),
        ),
        Option("fov", "vertical field of view in degrees: 0 to 180 of a perspective camera", "D", number),
        Option(
            "handedness",
            "left mirrors, as the course does; right shows the scene as a modelling program does (default: left)",
            "left|right",
        ),
    ),
)
SPP = Option("spp", "samples per pixel", "N", at_least_one)
ADAPTIVE = Option(
    "adaptive",
    "more samples where the error is larger (default: in long pictures with --time or --error, where it pays)",
    "",
    more={"action": BooleanOptionalAction},
)
WHEN_TO_STOP = Group(
    "when to stop",
    f"at the first that is reached; else after the samples of the scene file, or {USUAL_SPP} samples or "
    f"{USUAL_SECONDS:g} s for light, and 1 sample for a view",
    (
        SPP,
        Option("time", "seconds of rendering, without compiling", "SECONDS", positive),
        Option("error", "estimated relative RMSE of the picture: 5 or 5%%", "PERCENT", percentage),
        ADAPTIVE,
    ),
)
FIRST_SAMPLE = Option(
    "first_sample", "index of the first sample, to render parts elsewhere (default: %(default)s)", "K", whole, 0
)
KEEPING = Group(
    "stopping and going on",
    "",
    (
        Option("checkpoint", "keep the samples there, and go on from it if it exists", "FILE"),
        Option("checkpoint_every", "how often (default: %(default)s)", "SECONDS", positive, 30),
        FIRST_SAMPLE,
    ),
)
# What every picture has, also of a command that has no option for it.
OF_PICTURES = (*DISPLAY.options, *WHEN_TO_STOP.options, FIRST_SAMPLE)
GROUPS = FAR_LIGHT, SURFACES, COMPILED, RAYS, MACHINE, PICTURE, DISPLAY, PATHS, MIS, CAMERA, WHEN_TO_STOP, KEEPING
ALONE = UP_AXIS, PARTS_OPTION, LOOKUP, BY_BOUNCE
OPTIONS = {option.name: option for option in (*ALONE, *(option for group in GROUPS for option in group.options))}


# ── for the commands ──


def add(parser: Any, options: Iterable[Option], **texts: str) -> None:
    """Add options to a parser, or to a group of one; ``texts`` replace words in braces of what they mean."""
    for option in options:
        of = {"help": option.what.format(**texts), **option.more}
        if option.default is not None:
            of |= {"default": option.default}
        if option.metavar:
            of |= {"metavar": option.metavar, "type": option.read}
        parser.add_argument(option.flag, **of)


def add_group(parser: ArgumentParser, group: Group, leave: tuple[Option, ...] = (), **texts: str) -> Any:
    """Add a group of options, but those to ``leave``. Returns what further ones can be added to."""
    place = parser.add_argument_group(group.title, group.what or None) if group.title else parser
    add(place, (option for option in group.options if option not in leave), **texts)
    return place


def add_scene_argument(parser: ArgumentParser) -> None:
    """Add the scene alone, and which way it stands."""
    what = "name of a shipped scene, or a file: .obj .ply .stl .glb ..., or .xml of RT3"
    parser.add_argument("scene", metavar="SCENE", help=what)
    add(parser, [UP_AXIS])


def add_parts_option(parser: ArgumentParser) -> None:
    """Add the files that register parts of the user."""
    add(parser, [PARTS_OPTION, COURSE])


def add_scene_options(parser: ArgumentParser) -> None:
    """Add the scene, how its rays are intersected, and where that runs."""
    add_scene_argument(parser)
    add_parts_option(parser)
    light = add_light_options(parser, f"or none (default: the scene file's, or {USUAL_LIGHT} where light is asked for)")
    add(light, [LOOKUP])
    for group in (SURFACES, COMPILED, RAYS, MACHINE):
        add_group(parser, group)


def add_light_options(parser: ArgumentParser, otherwise: str) -> Any:
    """Add the environment; ``otherwise`` says what it is when it is not given."""
    return add_group(parser, FAR_LIGHT, otherwise=otherwise)


def add_surface_options(parser: ArgumentParser) -> None:
    """Add BRDFs and lights by name, without the choice of lamps, for a command that compares several of these."""
    add_group(parser, SURFACES, leave=(LAMP_CHOICE,))


def add_picture_options(parser: ArgumentParser) -> None:
    """Add what is shown, how large, and from where."""
    parser.set_defaults(**{option.name: option.default for option in OF_PICTURES})
    parser.add_argument(
        "--view",
        "--estimator",
        dest="view",
        action=OneOfOptions,
        metavar="NAME",
        help="what to show, or how to sample its light: one name, several with commas, or 'all' (default: the scene "
        "file's, or the one with a star)",
    )
    for group in (PICTURE, PATHS, MIS, CAMERA):
        add_group(parser, group)


def add_camera_options(parser: ArgumentParser) -> None:
    """Add from where the scene is seen."""
    add_group(parser, CAMERA)


def add_display_options(parser: ArgumentParser) -> None:
    """Add how light is shown on a screen and in files of 8 bits."""
    add_group(parser, DISPLAY)


def add_when_to_stop(parser: ArgumentParser) -> None:
    """Add when the rendering ends, and how it goes on another time."""
    for group in (WHEN_TO_STOP, KEEPING):
        add_group(parser, group)


def add_cluster_option(parser: ArgumentParser, what: str) -> None:
    """Add the cluster on which the work is done instead of here; ``what`` says which work."""
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help=f"{what} on the workers of a Dask cluster that runs, tcp://host:8786 or tls://host:8786, on local:N "
        "processes of this machine, or on slurm:N jobs; see docs/cluster.md",
    )


# ── from values to words ──


JOINED = {names: ",", size: "x"}  # what reads several values in one word → what stands between them


def words_of(**values: Any) -> list[str]:
    """The words that give these values to the options of the same names; nothing for a default, and for None."""
    words: list[str] = []
    for name, value in values.items():
        option = OPTIONS[name]
        if value is None or value == option.default:
            continue
        if not option.metavar:
            words += [option.flag if value else f"--no{option.flag[1:]}"]
        elif option.more.get("action") == "append":
            words += [word for one in value for word in (option.flag, one)]
        elif option.read in JOINED:
            words += [option.flag, JOINED[option.read].join(map(str, value))]
        else:
            several = value if isinstance(value, tuple) else (value,)
            words += [option.flag, *(str(one).removesuffix(".0") for one in several)]
    return words
