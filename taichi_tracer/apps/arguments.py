"""Options that several commands have, in the groups in which a help shows them.

Nothing here imports Taichi, nor anything else that is large: a help answers at once.
"""

from argparse import ArgumentParser, _ArgumentGroup

from taichi_tracer.apps.words import (
    LIGHT,
    PICTURE_SIZE,
    SMOOTH,
    OneOfOptions,
    degrees,
    names,
    number,
    positive,
    size,
    whole,
)


def add_scene_argument(parser: ArgumentParser) -> None:
    """Add the scene alone, and which way it stands."""
    what = "name of a shipped scene, or a file: .obj .ply .stl .glb ..., or .xml of RT3"
    parser.add_argument("scene", metavar="SCENE", help=what)
    parser.add_argument(
        "--up-axis",
        default="y",
        metavar="y|z",
        help="which axis of the scene points upwards: the view of a mesh, and the zenith of the environment, follow it "
        "(default: %(default)s)",
    )


def add_parts_option(parser: ArgumentParser) -> None:
    """Add the files that register parts of the user."""
    parser.add_argument(
        "--parts",
        action="append",
        metavar="FILE.py",
        help="run a Python file that registers parts of your own by @tt.register: their names can then be given as "
        "those of the package; may be given several times",
    )
    parser.add_argument(
        "--course",
        action="append",
        dest="parts",
        metavar="FOLDER",
        help="use a student's files of the course in the place of the package's: camera.py, ray_intersector.py, "
        "environment.py, sampler.py, renderer.py",
    )


def add_scene_options(parser: ArgumentParser) -> None:
    """Add the scene, how its rays are intersected, and where that runs."""
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


def add_light_options(parser: ArgumentParser, otherwise: str) -> _ArgumentGroup:
    """Add the environment; ``otherwise`` says what it is when it is not given."""
    light = parser.add_argument_group("light from far away")
    what = f"a shipped name, an image (.hdr .exr .png .jpg .npy), {otherwise}"
    light.add_argument("--environment", metavar="E", help=what)
    light.add_argument("--intensity", type=number, metavar="X", help="multiply its radiance")
    light.add_argument("--rotation", type=number, metavar="D", help="turn it about the upward axis by degrees")
    return light


def add_surface_options(parser: ArgumentParser, names_lamp_choice: bool = True) -> None:
    """Add BRDFs and lights by name; and one choice of lamps, unless a command compares several."""
    surfaces = parser.add_argument_group("surfaces and lights", "names with commas")
    surfaces.add_argument(
        "--brdfs", type=names, default=(), metavar="A,B", help="BRDFs that are asked first whether a material is theirs"
    )
    surfaces.add_argument(
        "--lights", type=names, default=(), metavar="A,B", help="lights of the scene, beside its environment"
    )
    if names_lamp_choice:
        surfaces.add_argument(
            "--lamp-choice", metavar="NAME", help="how a sample chooses among the surfaces with Ke > 0 (one name)"
        )
    surfaces.add_argument("--two-sided-lamps", action="store_true", help="triangles with Ke > 0 emit from both sides")


def add_picture_options(parser: ArgumentParser) -> None:
    """Add what is shown, how large, and from where."""
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


def add_display_options(parser: ArgumentParser) -> None:
    """Add how light is shown on a screen and in files of 8 bits."""
    what = "of light and colour, on the screen and in .png .jpg .ppm; other files, errors and comparisons stay linear"
    display = parser.add_argument_group("how it is shown", what)
    display.add_argument(
        "--exposure", type=number, default=0.0, metavar="STOPS", help="each doubles the light (default: %(default)g)"
    )
    display.add_argument("--tone", default="none", metavar="NAME", help="curve that bends bright values below white")


def add_path_options(parser: ArgumentParser) -> None:
    """Add how long paths are."""
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


def add_weight_options(parser: ArgumentParser) -> None:
    """Add how often ``mis_one_sample`` takes which direction."""
    weights = parser.add_argument_group(
        "weights", "of the two directions among which mis_one_sample draws lots; their sum counts as 1"
    )
    weights.add_argument("--mis-plight", type=number, metavar="W", help="one to a light (default: 0.5)")
    weights.add_argument("--mis-pbrdf", type=number, metavar="W", help="one from the BRDF (default: 0.5)")


def add_camera_options(parser: ArgumentParser) -> None:
    """Add from where the scene is seen."""
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


def add_cluster_option(parser: ArgumentParser, what: str) -> None:
    """Add the cluster on which the work is done instead of here; ``what`` says which work."""
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help=f"{what} on the workers of a Dask cluster that runs, tcp://host:8786 or tls://host:8786, or on local:N "
        "processes of this machine; see docs/cluster.md",
    )
