"""What ``taichi-tracer render`` is asked for: pictures, places, and when to stop."""

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass

from taichi_tracer.apps.requests import PictureRequest, SceneRequest, scene_and_pictures_of
from taichi_tracer.apps.same_again import DISTANCE
from taichi_tracer.apps.words import note, taken
from taichi_tracer.assignments import A4Renderer
from taichi_tracer.integrators.path_settings import DEFAULTS, Bounces, check_bounces, check_terms
from taichi_tracer.picture.aovs import Aov, find_aovs
from taichi_tracer.system.errors import InputError


@dataclass(frozen=True)
class RenderRequest:
    """The pictures of a scene that are to be made, where they go, and when to stop.

    Attributes:
        output: a file or a folder; None is where the scene file says, or ``PICTURE_FOLDER``.
        spp, time, error: what ends the rendering, as for ``ProgressiveRenderer.render``. Where all are None, it is the
            samples of the picture.
        bounces: (first, last) of the light that each picture counts, see ``PathSettings``; empty is one picture of all.
        checkpoint: a file to go on from, and to keep samples in every ``checkpoint_every`` seconds; or None.
        aovs: the raw arrays that each file has beside its picture.
        profile: whether a page tells where the time went.
    """

    scene: SceneRequest
    pictures: tuple[PictureRequest, ...]
    output: str | None
    spp: int | None
    time: float | None
    error: float | None
    bounces: tuple[Bounces, ...]
    checkpoint: str | None
    checkpoint_every: float
    aovs: tuple[Aov, ...]
    profile: bool

    def samples_of(self, picture: PictureRequest) -> int | None:
        """How many samples end the rendering of a picture; None where only time or error do."""
        return picture.spp if self.spp is None and self.time is None and self.error is None else self.spp


def render_of(args: Namespace) -> RenderRequest:
    """What the options of ``render`` ask for."""
    scene, pictures = scene_and_pictures_of(args)
    if args.max_distance is not None and all(one.name != DISTANCE for picture in pictures for _, one in picture.views):
        note(f"--max-distance {args.max_distance:g} changes nothing here: it belongs to the view {DISTANCE!r}")
    if args.bounces:
        check_pictures_by_bounce(args, pictures)
    error = None if args.error is None else args.error / 100
    return taken(RenderRequest, args, scene=scene, pictures=pictures, error=error, aovs=find_aovs(args.aov))


def check_pictures_by_bounce(args: Namespace, pictures: Sequence[PictureRequest]) -> None:
    """Raise an InputError unless there are pictures for ``--bounces`` that can be added up."""
    for picture in pictures:
        for renderer_class, integrator in picture.views:
            if not issubclass(renderer_class, A4Renderer):
                raise InputError(f"--bounces needs paths, and {integrator.name} has none: use --estimator path")
        for one in args.bounces:
            check_bounces(one)
        check_terms(args.bounces, dict(picture.paths).get("max_bounces", DEFAULTS["max_bounces"]))
    if len(args.bounces) > 1:
        given = [name for name in ("time", "error", "adaptive") if getattr(args, name)]
        if given:
            advice = "give --spp alone"
            raise InputError(f"--bounces takes the same samples for each picture, --{given[0]} does not: {advice}")
