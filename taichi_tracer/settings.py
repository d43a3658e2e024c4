"""One description of a picture: each setting is one field of ``RenderSettings``.

From a field come the option of the command line with its help, the words and the keyword arguments that make a picture
again, what a worker of a cluster gets, and what page and window can change. To add an option, add a field here, and use
it where it acts. Nothing here imports Taichi or anything large: a help answers at once.
"""

from argparse import ArgumentParser, BooleanOptionalAction, Namespace
from collections.abc import Callable
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, NamedTuple

from taichi_tracer.system.argument_types import (
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

USUAL_LIGHT = "studio"  # the environment of a picture that shows light, in a scene that has none
PICTURE_SIZE = "512x512"  # of a picture for which neither the user nor the scene file names a size
USUAL_SPP, USUAL_SECONDS = 64, 3.0  # when a picture of light ends for which nobody says when
SMOOTH = 30.0  # degrees of ``--smooth`` alone, as in ``formulas.vertex_normals``, which would load numpy
NO_NAME = "none"  # in place of the name of an environment: no light from far away

Vector = tuple[float, ...]


class Group(NamedTuple):
    """Settings that stand together in a help; without a title, they stand at its beginning."""

    title: str = ""
    what: str = ""


SCENE, PICTURE, ADVICE, BY_BOUNCE = Group(), Group(), Group(), Group()
FAR_LIGHT = Group("light from far away")
SURFACES = Group("surfaces and lights", "names with commas")
RAYS = Group("how rays are intersected")
MACHINE = Group("where it runs")
DISPLAY = Group(
    "how it is shown",
    "of light and colour, on the screen and in .png .jpg .ppm; other files, errors and comparisons stay linear",
)
PATHS = Group("paths", "for implicit, explicit and path, on which light bounces")
WEIGHTS = Group("weights", "of the two directions among which mis_one_sample draws lots; their sum counts as 1")
CAMERA = Group("camera", "what is not given is the scene's own")
TARGET = Group(
    "when to stop",
    f"at the first that is reached; else after the samples of the scene file, or {USUAL_SPP} samples or "
    f"{USUAL_SECONDS:g} s for light, and 1 sample for a view",
)
KEEPING = Group("stopping and going on")


class Option(NamedTuple):
    """What a field of ``RenderSettings`` means.

    Attributes:
        help: what it means, with its default. group: where it stands in a help.
        metavar: its words there; "" is an option without words.
        read: what makes the value of a word.
        part: the kind of registered part that it names.
        choices: the names that it may have, where they are no parts.
        value: the value of renderers that it changes, see ``ProgressiveRenderer.values``; "" if none.
        usual: the default of this value, or the name that counts when none is given.
        owner: for messages, what it belongs to.
        of: the only integrator that it belongs to; "" where it belongs to all that a renderer offers.
        more: further arguments of ``add_argument``.
    """

    help: str
    group: Group
    metavar: str | tuple[str, ...] = "NAME"
    read: Callable[[str], Any] = str
    part: str = ""
    choices: tuple[str, ...] = ()
    value: str = ""
    usual: Any = None
    owner: str = ""
    of: str = ""
    more: dict[str, Any] = {}


def setting(help: str, group: Group, *more: Any, default: Any = None, **named: Any) -> Any:
    """A field; further arguments as for ``Option``."""
    return field(default=default, metadata={"option": Option(help, group, *more, **named)})


def switch(help: str, group: Group) -> Any:
    """A field of an option without words."""
    return setting(help, group, "", more={"action": "store_true"}, default=False)


def vector(help: str, group: Group, metavar: tuple[str, ...] = ("X", "Y", "Z")) -> Any:
    """A field of several numbers."""
    return setting(help, group, metavar, number, more={"nargs": len(metavar)})


def value(name: str, usual: Any, help: str, group: Group, *more: Any, shown: str = "", **named: Any) -> Any:
    """A field that changes a value of renderers; ``shown`` is the default in the help, where it is not a number."""
    text = f"{help} (default: {shown or format(usual, 'g')})"
    return setting(text, group, *more, value=name, usual=usual, **named)


OF_WEIGHTS: Any = {"owner": "the estimator 'mis_one_sample'", "of": "mis_one_sample"}


@dataclass(frozen=True)
class RenderSettings:
    """A scene, its light, its camera and one picture of it. None leaves what the scene file says, or the default."""

    scene: str = ""
    up_axis: str | None = setting(
        "which axis of the scene points upwards: the view of a mesh, and the zenith of the environment, follow it "
        "(default: y, or z for a file that stands on a flat base then)",
        SCENE,
        "y|z",
        choices=("y", "z"),
        usual="y",
    )
    parts: tuple[str, ...] = setting(
        "run a Python file that registers parts of your own by @tt.register: their names can then be given as those "
        "of the package; may be given several times",
        ADVICE,
        "FILE.py",
        default=(),
        more={"action": "append"},
    )

    environment: str | None = setting(
        "a shipped name, an image (.hdr .exr .png .jpg .npy), or none (default: the scene file's, or "
        f"{USUAL_LIGHT} where light is asked for and there is none)",
        FAR_LIGHT,
        "E",
    )
    intensity: float | None = setting("multiply its radiance (default: 1)", FAR_LIGHT, "X", number)
    rotation: float | None = setting("turn it about the upward axis by degrees (default: 0)", FAR_LIGHT, "D", number)
    lookup: str | None = setting(
        "nearest texel of the environment, or bilinear (default: nearest)",
        FAR_LIGHT,
        choices=("nearest", "bilinear"),
        usual="nearest",
    )

    brdfs: tuple[str, ...] = setting(
        "BRDFs that are asked first whether a material is theirs (default: none beside the registered ones)",
        SURFACES,
        "A,B",
        names,
        "BRDF",
        default=(),
    )
    lights: tuple[str, ...] = setting(
        "lights of the scene, beside its environment (default: none but the scene file's)",
        SURFACES,
        "A,B",
        names,
        "light",
        default=(),
    )
    lamp_choice: str | None = setting(
        "how a sample chooses among the surfaces with Ke > 0 (one name; default: power for few, hierarchy for many)",
        SURFACES,
        part="lamp choice",
    )
    two_sided_lamps: bool = switch("triangles with Ke > 0 emit from both sides", SURFACES)

    smooth: float | None = setting(
        f"smooth normals where the file has none; edges that bend by more stay sharp (default of DEGREES: {SMOOTH:g})",
        SCENE,
        "DEGREES",
        degrees,
        more={"nargs": "?", "const": SMOOTH},
    )
    ground: bool = switch("a large diffuse square under everything; what has no material of its own is as grey", SCENE)
    effects: str | None = setting(
        "compile what the scene calls for, or everything (default: scene)",
        SCENE,
        "scene|all",
        choices=("scene", "all"),
        usual="scene",
    )

    background: Vector | None = vector(
        "colour behind everything, each number from 0 to 1 (default: the scene file's, or black)",
        SCENE,
        ("R", "G", "B"),
    )

    intersector: str | None = setting(
        "which intersector finds what a ray meets (default: bvh, or wide_bvh for many primitives or samples)",
        RAYS,
        part="intersector",
    )
    triangle_test: str | None = setting(
        "which ray-triangle test it uses (default: watertight)", RAYS, part="triangle test", usual="watertight"
    )

    arch: str | None = setting(
        "which backend runs the kernels (default: auto, a GPU where one works, else the CPU)", MACHINE
    )
    precision: str | None = setting("of every coordinate and colour (default: f32)", MACHINE)
    fast_math: bool = switch("let the compiler round and treat NaN freely", MACHINE)

    view: str | None = setting(
        "what to show, or how to sample its light: one name, several with commas, or 'all' (default: the scene "
        "file's, or the one with a star)",
        PICTURE,
        more={"action": OneOfOptions},
    )
    size: tuple[int, int] | None = setting(
        f"pixels (default: the scene file's, or {PICTURE_SIZE})", PICTURE, "WxH", size
    )
    quick: bool = switch("a quarter of the width and of the height", PICTURE)
    crop: Vector | None = vector(
        "render only this part of the frame, in fractions of it, y from the bottom (default: 0 1 0 1)",
        PICTURE,
        ("X0", "X1", "Y0", "Y1"),
    )
    max_distance: float | None = value(
        "max_distance",
        None,
        "the distance that the view 'distance' shows white",
        PICTURE,
        "UNITS",
        positive,
        shown="10, or a round number that fits the scene",
        owner="the view 'distance'",
        of="distance",
    )
    map_of: str | None = value(
        "of",
        "path",
        "the view, estimator or path whose work a map such as 'nodes' shows",
        PICTURE,
        shown="path",
        owner="maps of work",
    )
    sampler: str | None = setting(
        "where random numbers come from (default: niederreiter; niederreiter_two with --adaptive)",
        PICTURE,
        part="sampler",
        usual="niederreiter",
    )
    seed: int = setting("of the random numbers (default: %(default)s)", PICTURE, "S", whole, default=0)
    jitter: bool = switch("rays through random points of the pixels, in views too", PICTURE)

    exposure: float = setting("each doubles the light (default: %(default)g)", DISPLAY, "STOPS", number, default=0.0)
    tone: str = setting(
        "curve that bends bright values below white (default: %(default)s)", DISPLAY, part="tone curve", default="none"
    )

    max_bounces: int | None = value("max_bounces", 5, "how many surfaces may reflect", PATHS, "N", whole, owner="paths")
    rr_start_bounce: int | None = value(
        "rr_start_bounce", 3, "after so many, roulette may end a path", PATHS, "N", whole, owner="paths"
    )
    rr_termination_probability: float | None = value(
        "rr_termination_probability", 0.0, "with which it ends a path", PATHS, "Q", number, owner="paths"
    )
    roulette: str | None = value(
        "roulette",
        "course",
        "course: the constant Q; throughput: dark paths end first",
        PATHS,
        shown="course",
        owner="paths",
    )
    mis_plight: float | None = value("mis_plight", 0.5, "one to a light", WEIGHTS, "W", number, **OF_WEIGHTS)
    mis_pbrdf: float | None = value("mis_pbrdf", 0.5, "one from the BRDF", WEIGHTS, "W", number, **OF_WEIGHTS)
    bounces: tuple[tuple[int, int | None], ...] = setting(
        "one picture for the light after each of these numbers of bounces, such as 0,1,2,3+ or 0,1-4, and one with "
        "all of them side by side: FILE_bounce_0.png ..., FILE_bounces.png",
        BY_BOUNCE,
        "LIST",
        bounces,
        value="bounces",
        owner="paths",
        default=(),
    )

    eye: Vector | None = vector("position", CAMERA)
    at: Vector | None = vector("point looked at", CAMERA)
    up: Vector | None = vector("which way is up", CAMERA)
    camera: str | None = setting("how it projects (default: perspective)", CAMERA, part="camera", usual="perspective")
    window: Vector | None = vector(
        "left, right, bottom and top of the image plane: at distance 1, or in world units where orthographic",
        CAMERA,
        ("L", "R", "B", "T"),
    )
    fov: float | None = setting(
        "vertical field of view in degrees: 0 to 180 of a perspective camera", CAMERA, "D", number
    )
    handedness: str | None = setting(
        "left mirrors, as the course does; right shows the scene as a modelling program does (default: left)",
        CAMERA,
        "left|right",
        choices=("left", "right"),
        usual="left",
    )

    spp: int | None = setting("samples per pixel", TARGET, "N", at_least_one)
    time: float | None = setting("seconds of rendering, without compiling", TARGET, "SECONDS", positive)
    error: float | None = setting("estimated relative RMSE of the picture: 5 or 5%%", TARGET, "PERCENT", percentage)
    adaptive: bool | None = setting(
        "more samples where the error is larger (default: in long pictures with --time or --error, where it pays)",
        TARGET,
        "",
        more={"action": BooleanOptionalAction},
    )

    checkpoint: str | None = setting("keep the samples there, and go on from it if it exists", KEEPING, "FILE")
    checkpoint_every: float = setting("how often (default: %(default)s)", KEEPING, "SECONDS", positive, default=30)
    first_sample: int = setting(
        "index of the first sample, to render parts elsewhere (default: %(default)s)", KEEPING, "K", whole, default=0
    )

    @classmethod
    def of(cls, args: Namespace) -> "RenderSettings":
        """The settings that a command line gives; those for which the command has no option have their default."""
        given: dict[str, Any] = {
            name: found for name, found in vars(args).items() if name in OPTIONS or name == "scene"
        }
        lists = {name: tuple(found) for name, found in given.items() if isinstance(found, list)}
        return cls(**given | lists)

    def given(self, *names: str) -> dict[str, Any]:
        """Those of the settings that are not None, by name: keyword arguments."""
        return {name: found for name in names if (found := getattr(self, name)) is not None}

    def changed(self) -> dict[str, Any]:
        """Those that are not the default, by name."""
        return {f.name: getattr(self, f.name) for f in fields(self) if getattr(self, f.name) != f.default}

    def values(self) -> dict[str, Any]:
        """What is said of the values of renderers, by their names; not of single bounces."""
        options = ((one.value, getattr(self, name)) for name, one in OPTIONS.items() if name != "bounces")
        return {name: found for name, found in options if name and found is not None}

    def words(self) -> list[str]:
        """The options of the command line that ask for the same, beside the name of the scene."""
        changed = self.changed()
        changed.pop("scene", None)
        return [word for name, found in changed.items() for word in words_of(name, found)]


OPTIONS: dict[str, Option] = {f.name: f.metadata["option"] for f in fields(RenderSettings) if f.metadata}
DEFAULTS = {f.name: f.default for f in fields(RenderSettings) if f.default is not MISSING}
JOINED = {names: ",", size: "x"}  # what reads several values in one word → what stands between them


def usual_values(group: Group) -> dict[str, Any]:
    """The values of renderers that settings of a group change, with their defaults."""
    return {one.value: one.usual for one in OPTIONS.values() if one.group is group and one.value}


def flag_of(name: str) -> str:
    """The option of a setting as it is written."""
    return f"--{name.replace('_', '-')}"


def words_of(name: str, value: Any) -> list[str]:
    """The words that give a setting a value."""
    option, flag = OPTIONS[name], flag_of(name)
    if not option.metavar:
        return [flag if value else f"--no{flag[1:]}"]
    if option.more.get("action") == "append":
        return [word for one in value for word in (flag, one)]
    if option.read in JOINED:
        return [flag, JOINED[option.read].join(map(str, value))]
    if option.read is bounces:
        return [flag, ",".join(name_of_bounces(one) for one in value)]
    several = value if isinstance(value, tuple) else (value,)
    return [flag, *(str(one).removesuffix(".0") for one in several)]


def name_of_bounces(bounces: tuple[int, int | None]) -> str:
    """The name of some bounces, as ``--bounces`` takes it: "1", "2-4" or "3+"."""
    first, last = bounces
    return f"{first}+" if last is None else str(first) if first == last else f"{first}-{last}"


def add_options(parser: ArgumentParser, *groups: Group, leave: tuple[str, ...] = ()) -> None:
    """Add groups of options to a parser, but those to ``leave``."""
    for group in groups:
        place: Any = parser.add_argument_group(group.title, group.what or None) if group.title else parser
        for name, option in OPTIONS.items():
            if option.group is group and name not in leave:
                add_option(place, name)


def add_option(place: Any, name: str) -> None:
    """Add one option to a parser or to a group of one."""
    option = OPTIONS[name]
    flags = [flag_of(name), "--estimator"] if name == "view" else [flag_of(name)]
    default = [] if option.more.get("action") == "append" else DEFAULTS[name]  # argparse appends to a list alone
    of: dict[str, Any] = {"help": option.help, "default": default, **option.more}
    if option.metavar:
        of |= {"metavar": option.metavar, "type": option.read}
    place.add_argument(*flags, **of)
    if name == "parts":
        course = "use a student's files of the course in the place of the package's: camera.py, ray_intersector.py, "
        course += "environment.py, sampler.py, renderer.py"
        place.add_argument("--course", metavar="FOLDER", action="append", dest="parts", help=course)


def add_scene(parser: ArgumentParser, *groups: Group) -> None:
    """Add the scene, and groups of its options."""
    what = "name of a shipped scene, or a file: .obj .ply .stl .glb ..., or .xml of RT3"
    parser.add_argument("scene", metavar="SCENE", help=what)
    add_options(parser, *groups)


OF_SCENE = SCENE, ADVICE, FAR_LIGHT, SURFACES, RAYS, MACHINE
OF_PICTURE = PICTURE, PATHS, WEIGHTS, CAMERA
