"""Pictures on more than one machine, by Dask: sample ranges go out, and sums come back; docs/cluster.md.

    import taichi_tracer as tt
    result = tt.cluster.render("cornell_box", cluster="local:2", estimator="mis", environment="studio", spp=256)
    tt.save_image("box.exr", result.image)

The options of a picture are those of ``taichi-tracer render``, with ``_`` in place of ``-``. Nothing of the caller's
scenes and renderers is touched, but Taichi runs here too, in the precision that is asked for.
"""

import warnings
from argparse import Namespace
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from taichi_tracer.cluster.clusters import Cluster
    from taichi_tracer.files.picture import Picture
    from taichi_tracer.picture.error_estimate import RelativeError


@dataclass(frozen=True)
class Result:
    """A picture that a cluster made.

    Attributes:
        image: (height, width, 3) float32, linear, top row first; it knows whether it is light.
        samples: per pixel. error: relative RMSE with its interval; None where the picture has none.
        seconds: of rendering.
    """

    image: "Picture"
    samples: int
    error: "RelativeError | None"
    seconds: float


def connect(cluster: str, tell: Callable[[str], Any] = warnings.warn) -> "Cluster":
    """A context with a connection that several calls can share, so that workers start Taichi only once.

    Args:
        cluster: "local" or "local:N" for N processes on this machine, "tcp://host:8786" or "tls://host:8786" of a
            scheduler that runs, or "slurm:N" for N jobs.
        tell: called with each line that the user should know.
    """
    from taichi_tracer.cluster.clusters import Cluster

    return Cluster(cluster, tell)


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
    """One picture, whose samples all workers take together: the same samples as one process would take.

    Args:
        scene: a name or a path.
        cluster: see ``connect``, or what ``connect`` gives.
        spp, time, error: as for ``ProgressiveRenderer.render``; what ends it first.
        checkpoint: a file to go on from if it exists, and to which the samples go in the end, whatever ended it.
        watch: called with the progress several times a second; an error that it raises ends the rendering.
        options: of ``taichi-tracer render``, such as estimator="mis", size=(256, 256), eye=(0, 1, 3).

    Raises:
        InputError: an option is wrong, or no scheduler answers. IncompleteError: the cluster was lost on the way; what
            came is in ``checkpoint``.
    """
    from taichi_tracer.apps.requests import scene_and_pictures_of
    from taichi_tracer.cluster.sharing import renders_on
    from taichi_tracer.files.disk import check_place, noting_reads
    from taichi_tracer.system.errors import InputError

    args = namespace(scene, options)
    if checkpoint is not None:
        check_place(checkpoint)
    context: Any = connect(cluster) if isinstance(cluster, str) else nullcontext(cluster)
    with context as connection, noting_reads() as paths:
        scene_request, (picture, *more) = scene_and_pictures_of(args)
        (renderer_class, integrator), *others = picture.views
        if more or others:
            raise InputError("cluster.render makes one picture: give one view or estimator")
        loaded = scene_request.load()
        renderer = picture.make_renderer(renderer_class, loaded).use(integrator.name)
        if checkpoint is not None and Path(checkpoint).exists():
            renderer.load_checkpoint(checkpoint)
            spp = None if spp is None else spp - renderer.samples
        try:
            if spp is None or spp > 0:
                renders_on(connection, args, paths, renderer, (0, 0, None))(spp, time, error, watch)
        finally:
            if checkpoint is not None and renderer.samples > 0 and renderer.is_random:
                renderer.save_checkpoint(checkpoint)
        found = renderer.error() if renderer.is_random and renderer.samples > 1 else None
        image = renderer.film.own_pixels(renderer.image())
        return Result(image, renderer.samples, found, renderer.progress.seconds)


def namespace(scene: str | Path, options: Mapping[str, Any]) -> Namespace:
    """The namespace of ``taichi-tracer render SCENE …``: True is an option alone, None is none, a size is 640x480."""
    from taichi_tracer.apps.cli import arguments_of

    words = ["render", str(scene)]
    for name, value in options.items():
        flag, several = f"--{name.replace('_', '-')}", value if isinstance(value, list | tuple) else [value]
        texts = [str(one) for one in several if one is not True]
        if name == "parts":
            words += [word for text in texts for word in (flag, text)]
        elif value is not None and value is not False:
            joint = "x" if name == "size" else "," if all(isinstance(one, str) for one in several) else " "
            words += [flag, *joint.join(texts).split(" ")] if texts else [flag]
    return arguments_of(words)
