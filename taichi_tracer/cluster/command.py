"""The commands ``render``, ``grade`` and ``accuracy`` with ``--cluster``: workers of a cluster do what they ask for."""

from argparse import Namespace
from collections.abc import Callable
from functools import partial
from typing import Any

from taichi_tracer.apps import render as render_command
from taichi_tracer.apps.requests import MachineRequest
from taichi_tracer.apps.words import note
from taichi_tracer.cluster.members import Cluster
from taichi_tracer.cluster.parcel import Parcel, pack
from taichi_tracer.cluster.sharing import Sharing, Statistics
from taichi_tracer.files.disk import noting_reads
from taichi_tracer.picture.progress import Target
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError


def render(args: Namespace) -> int:
    """Render and write every view that was asked for, on a cluster."""
    if args.profile:
        raise InputError("--profile measures the process that renders, and on a cluster others do: not --cluster")
    tell_of_parts(args)
    with noting_reads() as paths, Cluster(args.cluster, note) as cluster:
        return render_command.run(args, OnCluster(cluster, args, paths))


def turntable(args: Namespace) -> int:
    """Render a film, every frame of it on a cluster."""
    from taichi_tracer.apps import turntable as command

    tell_of_parts(args)
    with noting_reads() as paths, Cluster(args.cluster, note) as cluster:

        def renders_frame(renderer: Any, eye: Any) -> Callable:
            """What takes the samples of a frame: the workers get a command line with its eye."""
            frame = OnCluster(cluster, Namespace(**{**vars(args), "eye": tuple(eye.tolist())}), paths)
            frame.loaded(renderer.scene_data)
            return frame.renders(renderer, (0, 0, None))

        return command.run(args, renders_frame)


def tell_of_parts(args: Namespace) -> None:
    """Say that code of the user goes to the workers."""
    if args.parts:
        note(f"the files of --parts go to every worker, and run there with its rights: {', '.join(args.parts)}")


class OnCluster:
    """The workers of a cluster, which take samples for ``apps.render.run``.

    Args:
        args: the command line. paths: the files that were read since it was looked at.
    """

    def __init__(self, cluster: Cluster, args: Namespace, paths: dict) -> None:
        self.cluster, self.args, self.paths = cluster, args, paths
        MachineRequest(args.arch, args.precision, args.fast_math).start()
        settings = runtime.current()
        cluster.prepare(settings.arch, settings.precision, settings.fast_math)
        cluster.begin()
        self.parcel: Parcel | None = None
        self.statistics: list[Statistics] = []

    def loaded(self, scene: SceneData) -> None:
        """Pack the scene, which was loaded here, so that its files are known."""
        self.parcel = pack(self.args, self.paths)

    def renders(self, renderer: Any, which: tuple) -> Callable:
        """What takes the place of ``renderer.render``."""
        if not renderer.is_random:
            note(f"{renderer.active.name} needs one sample: it is rendered here")
            return renderer.render
        return partial(self.render, renderer, which)

    def render(
        self,
        renderer: Any,
        which: tuple,
        spp: int | None = None,
        time: float | None = None,
        error: float | None = None,
        watch: Callable | None = None,
    ) -> None:
        """Add samples to the renderer's film until the first of the targets is reached."""
        if self.parcel is None:
            raise RuntimeError("the scene must be loaded first")
        target = Target.of(spp, time, error)
        self.statistics.append(Sharing(self.cluster, renderer, self.parcel, which, target).run(watch))
