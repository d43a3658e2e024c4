"""Pictures on more than one machine, by Dask: sample ranges go out, and sums come back; docs/cluster.md.

    import taichi_tracer as tt
    result = tt.cluster.render("cornell_box", cluster="local:2", estimator="mis", environment="studio", spp=256)
    tt.save_image("box.exr", result.image)

The options of a picture are those of ``taichi-tracer render``, with ``_`` in place of ``-``. Nothing of the caller's
scenes and renderers is touched, but Taichi runs here too, in the precision that is asked for.
"""

import math
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from taichi_tracer.cluster.members import Cluster
    from taichi_tracer.cluster.parcel import Parcel
    from taichi_tracer.cluster.sharing import Statistics
    from taichi_tracer.files.picture import Picture
    from taichi_tracer.picture.error_estimate import RelativeError
    from taichi_tracer.progressive import ProgressiveRenderer


@dataclass(frozen=True)
class Result:
    """A picture that a cluster made.

    Attributes:
        image: (height, width, 3) float32, linear, top row first; it knows whether it is light.
        samples: per pixel. error: relative RMSE with its interval; None where the picture has none.
        seconds: of rendering: on all workers together, from the first range to the end; or, in a sweep, on its worker.
        statistics: what the cluster did; None in a sweep.
    """

    image: "Picture"
    samples: int
    error: "RelativeError | None"
    seconds: float
    statistics: "Statistics | None" = None


@contextmanager
def connect(cluster: str, tell: Callable[[str], Any] | None = None) -> "Iterator[Cluster]":
    """A connection that several calls can share, so that workers start Taichi and get each file only once.

    Args:
        cluster: "tcp://host:8786" or "tls://host:8786" of a scheduler that runs; "local" or "local:N" for N processes
            on this machine.
        tell: called with each line that the user should know; None warns.
    """
    from taichi_tracer.cluster.members import Cluster

    with Cluster(cluster, warn if tell is None else tell) as connection:
        yield connection


def warn(text: str) -> None:
    """Tell a Python program what the command line would print."""
    import warnings

    warnings.warn(text, stacklevel=2)


def render(
    scene: str | Path,
    *,
    cluster: "str | Cluster" = "local",
    spp: int | None = None,
    time: float | None = None,
    error: float | None = None,
    checkpoint: str | Path | None = None,
    watch: Callable[[Any], Any] | None = None,
    **options: Any,
) -> Result:
    """One picture, whose samples all workers take together. It has the bits that one process would give it.

    Args:
        scene: a name or a path.
        cluster: an address, see ``connect``, or what ``connect`` gives.
        spp, time, error: as for ``ProgressiveRenderer.render``; what ends it first.
        checkpoint: a file to go on from if it exists, and to which the samples go in the end, whatever ended it.
        watch: called with the progress several times a second; an error that it raises ends the rendering.
        options: of ``taichi-tracer render``, such as estimator="mis", size=(256, 256), eye=(0, 1, 3).

    Raises:
        InputError: an option is wrong, or no scheduler answers. IncompleteError: the cluster was lost on the way; what
            came is in ``checkpoint``.
    """
    from taichi_tracer.cluster.command import OnCluster
    from taichi_tracer.files.disk import check_place, noting_reads
    from taichi_tracer.system.errors import InputError

    args = namespace(scene, options)
    if checkpoint is not None:
        check_place(checkpoint)
    with opened(cluster) as connection, noting_reads() as paths:
        (scene_request, picture), elsewhere = requests(args), OnCluster(connection, args, paths)
        loaded = scene_request.load()
        elsewhere.loaded(loaded)
        (renderer_class, integrator), *others = picture.views
        if others:
            raise InputError("cluster.render makes one picture: give one view or estimator")
        renderer = picture.make_renderer(renderer_class, loaded).use(integrator.name)
        if checkpoint is not None and Path(checkpoint).exists():
            renderer.load_checkpoint(checkpoint)
            spp = None if spp is None else spp - renderer.samples
        if spp is None or spp > 0:
            try:
                elsewhere.renders(renderer, (0, 0, None))(spp=spp, time=time, error=error, watch=watch)
            finally:
                if checkpoint is not None and renderer.samples > 0 and renderer.is_random:
                    renderer.save_checkpoint(checkpoint)
        return result_here(renderer, elsewhere.statistics)


def sweep(
    pictures: Sequence[Mapping[str, Any]],
    *,
    cluster: "str | Cluster" = "local",
    spp: int | None = None,
    time: float | None = None,
    error: float | None = None,
    watch: Callable[[int, Result], Any] | None = None,
    **common: Any,
) -> list[Result]:
    """Many pictures, each rendered by one worker: cameras, scenes, or variants of one picture.

    Args:
        pictures: of each, its options; the scene is one of them: [{"scene": "cube", "eye": (1, 2, 3)}, …].
        spp, time, error: of each picture. common: options of all pictures.
        watch: called with the number and the result of each picture as soon as it is there.

    Returns:
        The results, in the order of ``pictures``. Pictures that share a scene get it only once per worker.
    """
    from taichi_tracer.cluster import worker
    from taichi_tracer.cluster.jobs import Sweep, in_order
    from taichi_tracer.system import runtime

    parcels, (arch, precision, fast_math) = parcels_of([{**common, **one} for one in in_order(pictures)])
    targets = (1 if spp is None and time is None and error is None else spp), time, error
    with opened(cluster) as connection:
        runtime.init(**{k: v for k, v in (("arch", arch), ("precision", precision)) if v}, fast_math=fast_math)
        settings = runtime.current()
        connection.prepare(settings.arch, settings.precision, settings.fast_math)

        def submit(i: int, member: Any) -> Any:
            """Give a picture to a worker."""
            words = connection.session, parcels[i].message(), list(targets), list(parcels[i].hashes)
            pieces = connection.pieces_for(member, parcels[i])
            return connection.submit(worker.picture, *words, *pieces, at=[member.address])

        report = None if watch is None else lambda i, answer: watch(i, result_of(answer))
        return [result_of(answer) for answer in Sweep(connection, submit, len(parcels)).run(report)]


def turntable(
    count: int, at: Sequence[float], distance: float, height: float = 0.0, up_axis: str = "y"
) -> list[dict[str, Any]]:
    """Cameras on a circle around a point, for ``sweep``.

    Args:
        count: of cameras. at: the point that they look at.
        distance: from the axis, in units of the scene. height: of the circle over ``at``.
    """
    x, y, z = at
    found = []
    for angle in (2 * math.pi * i / count for i in range(count)):
        a, b = distance * math.sin(angle), distance * math.cos(angle)
        eye = (x + a, y + height, z + b) if up_axis == "y" else (x + a, y - b, z + height)
        found.append({"eye": eye, "at": (x, y, z), "up_axis": up_axis})
    return found


def variants(**knobs: Sequence[Any]) -> list[dict[str, Any]]:
    """The variants of a study of accuracy, for ``sweep``: variants(estimator=["brdf", "mis"], seed=range(3)).

    Every combination of the values, the last knob running first.
    """
    from itertools import product

    return [dict(zip(knobs, values, strict=True)) for values in product(*knobs.values())]


# ── from options to requests ──


def opened(cluster: "str | Cluster") -> Any:
    """A context with the connection: a new one for an address."""
    return connect(cluster) if isinstance(cluster, str) else nullcontext(cluster)


def namespace(scene: str | Path, options: Mapping[str, Any], command: str = "render") -> Namespace:
    """The namespace of the command line ``taichi-tracer COMMAND SCENE …`` with these options."""
    from taichi_tracer.apps.cli import arguments_of

    words = [command, str(scene)]
    for name, value in options.items():
        words += words_of(f"--{name.replace('_', '-')}", value)
    return arguments_of(words)


def words_of(option: str, value: Any) -> list[str]:
    """An option as words: True is the option alone, False and None are nothing, a size is 640x480."""
    if value is None or value is False:
        return []
    if value is True:
        return [option]
    if option == "--size" and not isinstance(value, str | int):
        return [option, "x".join(map(str, value))]
    if option == "--parts" and not isinstance(value, str | Path):
        return [word for path in value for word in (option, str(path))]
    if isinstance(value, str | Path) or not isinstance(value, Sequence):
        return [option, str(value)]
    if all(isinstance(one, str) for one in value):
        return [option, ",".join(value)]
    return [option, *map(str, value)]


def requests(args: Namespace) -> tuple[Any, Any]:
    """The requests of a scene and of its one picture."""
    from taichi_tracer.apps.requests import scene_and_pictures_of
    from taichi_tracer.system.errors import InputError

    scene, pictures = scene_and_pictures_of(args)
    if len(pictures) != 1:
        raise InputError(f"{args.scene} has {len(pictures)} pictures: a cluster renders one of them at a time")
    return scene, pictures[0]


def parcels_of(pictures: Sequence[Mapping[str, Any]]) -> "tuple[list[Parcel], tuple]":
    """The parcels of some pictures, each a mapping of options; and how their Taichi has to run.

    Raises:
        InputError: they do not agree about that, or one of them cannot be loaded.
    """
    from taichi_tracer.cluster.parcel import pack
    from taichi_tracer.files.disk import noting_reads
    from taichi_tracer.system.errors import InputError

    known: dict[tuple, dict] = {}
    found, machines = [], []
    for one in pictures:
        if "scene" not in one:
            raise InputError("cluster.sweep: each picture needs a scene")
        args = namespace(one["scene"], {name: value for name, value in one.items() if name != "scene"})
        machines.append((args.arch, args.precision, args.fast_math))
        key = str(args.scene), args.environment, args.view
        if key not in known:
            with noting_reads() as paths:
                requests(args)[0].load().destroy()
            known[key] = paths
        found.append(pack(args, known[key]))
    if len(set(machines)) > 1:
        raise InputError("cluster.sweep: all pictures need the same arch, precision and fast_math: make several sweeps")
    return found, machines[0]


def result_here(renderer: "ProgressiveRenderer", statistics: "Sequence[Statistics]") -> Result:
    """The result on the film of a renderer, of which a cluster told these statistics, one for each rendering."""
    told = renderer.error() if renderer.is_random and renderer.samples > 1 else None
    last = statistics[-1] if statistics else None
    seconds = 0.0 if last is None else last.seconds
    return Result(renderer.film.own_pixels(renderer.image()), renderer.samples, told, seconds, last)


def result_of(answer: Mapping[str, Any]) -> Result:
    """The result of what a worker sent."""
    from taichi_tracer.files.picture import Picture

    return Result(Picture(answer["image"], answer["srgb"]), answer["samples"], answer["error"], answer["seconds"])
