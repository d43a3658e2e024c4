"""Pictures on more than one machine, by Dask; see docs/cluster.md.

A file has one role: the client, the division of samples, or the worker and its jobs. Add another kind of cluster to
``clusters.py``.

    import taichi_tracer as tt
    result = tt.cluster.render("cornell_box", cluster="local:2", estimator="mis", environment="studio", spp=256)
    tt.save_image("box.exr", result.image)

The options of a picture are those of ``taichi-tracer render``, with ``_`` in place of ``-``. Nothing of the caller's
scenes and renderers is touched, but Taichi runs here too, in the precision that is asked for.
"""

import warnings
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from taichi_tracer.cluster.clusters import Cluster
    from taichi_tracer.files.images import Picture
    from taichi_tracer.picture.error_estimate import RelativeError
    from taichi_tracer.settings import RenderSettings


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
    from taichi_tracer.apps.pictures import request_of
    from taichi_tracer.cluster.sharing import renders_on
    from taichi_tracer.files.disk import check_place, noting_reads

    settings = settings_from(scene, options)
    check_place(checkpoint)
    context: Any = connect(cluster) if isinstance(cluster, str) else nullcontext(cluster)
    with context as connection, noting_reads() as paths:
        request = request_of(settings)
        renderer = request.single("cluster.render").make_renderer(request.load())
        if checkpoint is not None and Path(checkpoint).exists():
            renderer.load_checkpoint(checkpoint)
            spp = None if spp is None else spp - renderer.samples
        try:
            if spp is None or spp > 0:
                renders_on(connection, settings, paths, renderer)(spp, time, error, watch)
        finally:
            if checkpoint is not None and renderer.samples > 0 and renderer.is_random:
                renderer.save_checkpoint(checkpoint)
        found = renderer.error() if renderer.is_random and renderer.samples > 1 else None
        image = renderer.film.own_pixels(renderer.image())
        return Result(image, renderer.samples, found, renderer.progress.seconds)


def settings_from(scene: str | Path, options: Mapping[str, Any]) -> "RenderSettings":
    """The settings of ``taichi-tracer render SCENE …`` with these options; InputError for one that it does not have."""
    from taichi_tracer.apps.cli import make_parser
    from taichi_tracer.apps.console import load_parts
    from taichi_tracer.settings import DEFAULTS, OPTIONS, RenderSettings, words_of
    from taichi_tracer.system.errors import one_of

    words = ["render", str(scene)]
    for name, value in options.items():
        known = {"estimator": "view"}.get(name, name)
        if known not in OPTIONS:
            raise one_of("option", name, OPTIONS)
        several = tuple(value) if isinstance(value, list) else value
        several = (value,) if known in ("parts", "brdfs", "lights") and isinstance(value, str) else several
        words += [] if value is None or value is DEFAULTS[known] else words_of(known, several)
    found = RenderSettings.of(make_parser(only="render").parse_args(words))
    load_parts(found.parts)
    return found
