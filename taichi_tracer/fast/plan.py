"""What stands in for a plain form, and why: the only module of this folder that others may ask (``forms``)."""

import math
from typing import Any

from taichi_tracer.fast.counted_tiles import CountedTiles
from taichi_tracer.fast.far_light import form_class
from taichi_tracer.fast.kept_forms import KEPT, key_of, key_of_packets
from taichi_tracer.fast.nearest import FastBruteForce, FastIntersector
from taichi_tracer.fast.primary_hits import PrimaryHits, have_packets, is_small, pixels_in, why_not_kept
from taichi_tracer.fast.tiles import LEAST, TILES, Tiles, can_take_tiles, is_worth_tiles, why_no_tiles
from taichi_tracer.fast.view_tiles import ViewTiles, can_show
from taichi_tracer.fast.wide_bvh import WideBVH
from taichi_tracer.fast.wide_instances import WideInstances
from taichi_tracer.forms import EyeRays, Form, Plan, plain_rays
from taichi_tracer.picture.progress import Target
from taichi_tracer.system.recent import Recent
from taichi_tracer.system.seams import replaced, why_replaced
from taichi_tracer.system.stopwatch import EYE_RAYS, SAMPLES, stage

INTERSECTORS = {cls.stands_in_for: cls for cls in (WideBVH, WideInstances, FastBruteForce)}
KEPT_INTEGRATORS = 8  # forms of estimators: going back to one of so many compiles nothing
NOTED = 0.2  # seconds of rendering without tiles: fewer are not noted
KEPT_TILES = 4  # the same of their tiles, which need more memory
OF_PACKAGE = "camera and intersector belong to the package"
KEPT_HITS = Form("eye rays", "hits are kept; large pictures use packets", OF_PACKAGE, True)


def intersector_of(chosen: type, fast: bool) -> tuple[type, Form]:
    """The class that runs in place of the chosen class (it may be the same), and the reason."""
    if chosen not in INTERSECTORS:
        return chosen, Form("rays", f"{chosen.__name__}, as it is written", "it has no fast form")
    if not fast:
        return chosen, Form("rays", f"{chosen.__name__}, the plain form", "fast=False")
    if why := why_replaced(chosen):
        return chosen, Form("rays", f"{chosen.__name__}, the plain form", why)
    stand_in = INTERSECTORS[chosen]
    return stand_in, Form("rays", stand_in.form, f"no method of {chosen.__name__} is replaced", True)


def plan_of(renderer: Any) -> Plan:
    """The plan of a renderer."""
    why = why_plain(renderer)
    if "shade_ray" in renderer.replaced or not renderer.fast:
        return Plan(renderer, why)
    return FastPlan(renderer, why)


def why_plain(renderer: Any) -> str:
    """Why a picture does not keep the hits of its eye rays; "" if it may."""
    if not renderer.fast:
        return "fast=False"
    if why := why_replaced(renderer.camera):
        return why
    if "start" in replaced(renderer.sampler):
        return why_replaced(renderer.sampler)
    intersector = renderer.scene_data.ray_intersector
    return "" if isinstance(intersector, FastIntersector) else f"{type(intersector).__name__} is a plain form"


class FastPlan(Plan):
    """A plan in which fast forms stand in for plain ones, as soon as they are worth their compilation.

    Args:
        renderer: the ``ProgressiveRenderer``. why: ``why_plain``.
    """

    def __init__(self, renderer: Any, why: str) -> None:
        super().__init__(renderer, why)
        self.may_keep_hits = why == ""
        self.passes = 0  # over all pixels, for all pictures so far
        self.passes_before = 0  # the same before the present ``render``
        self.passes_expected = 0.0  # for the present ``render``
        self._integrators = Recent(KEPT_INTEGRATORS)
        self._timed: Any = None  # the estimator of ``seconds_of_others``
        self.seconds_of_others = 0.0  # of rendering: of earlier pictures with the same estimator
        self.tiles: Tiles | None = None
        self._tiles = Recent(KEPT_TILES)
        self.view_tiles: ViewTiles | None = None
        self.choose_eye_rays()

    def choose_eye_rays(self, passes: float = math.inf, in_tiles: bool = False) -> None:
        """Choose the form of the eye rays.

        Args:
            passes: how many passes the picture will have; ∞ if this is unknown.
            in_tiles: whether samples are taken tile by tile.
        """
        if not self.may_keep_hits:
            return
        r = self.renderer
        why = ""
        if r.jitter and not in_tiles:
            why = why_not_kept(r.scene_data, r.camera, r.sampler, r.film.ranges, passes)
            why = "few pixels take a sample in each pass" if r.shares.are_few else why
        if why:
            self.eye_rays, self.form = EyeRays(r.scene_data, r.camera, r.jitter), plain_rays(why)
            return
        hits = PrimaryHits(r.scene_data, r.camera, r.jitter, r.sampler, shares=r.shares, ranges=r.film.ranges)
        hits.is_long = in_tiles or (r.jitter and passes < math.inf)  # new rays are kept only for the packets
        self.eye_rays, self.form = hits, KEPT_HITS

    def expect(self, target: Target, is_continued: bool, passes: float | None = None) -> None:
        """Choose the forms; earlier passes count, too: who has rendered much will render more."""
        r = self.renderer
        if self._timed is not r.active:
            self._timed, self.seconds_of_others = r.active, 0.0
        elif not is_continued:
            self.seconds_of_others += r.rendered_seconds
        self.passes_before = self.passes
        passes = self.passes_expected = target.passes(pixels_in(r.film.ranges)) if passes is None else passes
        kept = self.eye_rays if isinstance(self.eye_rays, PrimaryHits) else None
        is_free = kept is None or r.shares.are_few or (kept.traces == 0 and kept.use_packets is None)
        if is_free and passes > 1:  # single samples are those of a window, which goes on for as long as somebody looks
            former, form = self.eye_rays, self.form
            self.choose_eye_rays(passes + self.passes)
            if type(self.eye_rays) is type(former):
                self.eye_rays, self.form = former, form
        if isinstance(self.eye_rays, PrimaryHits):
            self.eye_rays.passes = math.inf if target.spp is None and target.time is None else passes

    def integrator(self, scene: Any) -> Any:
        """The integrator in use, or the form that stands in for it."""
        active = self.renderer.active
        form = form_class(scene, active)
        return active if form is None else self._integrators.get((scene, active), lambda: form(active))

    @property
    def compiled(self) -> frozenset:
        """The forms of the kernels that were used so far."""
        of_rays = getattr(self.eye_rays, "forms", frozenset({"plain"}))
        return of_rays | {"tiles"} if self.in_tiles else of_rays

    @property
    def passes_at_once(self) -> int:
        """One, if each pass has other eye rays, which wait for their samples."""
        is_plain = self.tiles is None and not isinstance(self.eye_rays, PrimaryHits)
        return super().passes_at_once if is_plain else 1

    def take(self, index: int, count: int = 1) -> None:
        """Take so many samples for every pixel: together in the plain form, otherwise one after the other."""
        r = self.renderer
        scene = self.prepared_scene()
        tiles = self.tiles_for(scene)
        if count > 1 and (tiles is not None or isinstance(self.eye_rays, PrimaryHits)):
            for k in range(count):
                self.take(index + k)
            return
        self.passes += count
        with stage(EYE_RAYS, waits=True):
            self.trace_eye_rays(index)
        view_tiles = self.tiles_of_view()
        with stage(SAMPLES, waits=True):
            if tiles is not None:
                tiles.take(r.seed, index)
            elif view_tiles is not None:
                view_tiles.take(r, scene, r.active, r.seed, index)
            else:
                self.take_each(scene, index, count)

    def tiles_for(self, scene: Any) -> Tiles | None:
        """What takes the samples of whole tiles, if it exists, or is possible and worth its compilation."""
        r = self.renderer
        if r.use_tiles is False:
            return None
        if self.tiles is None or self.tiles.is_of != (scene, r.active):
            were_used = (scene, r.active, self.eye_rays, r.watcher) in self._tiles
            is_long = is_worth_tiles(r.progress, r.seconds_before, self.seconds_of_others)
            is_wanted = (
                were_used
                or r.use_tiles
                or self.keeps_tiles
                or is_long
                or self.has_paid(scene, r.active, r.progress.target)
            )
            is_possible = is_wanted and not r.shares.are_few and can_take_tiles(r, scene, r.active)
            if is_possible and isinstance(self.eye_rays, EyeRays):
                self.choose_eye_rays(in_tiles=True)
            key = scene, r.active, self.eye_rays, r.watcher
            self.tiles = self._tiles.get(key, lambda: self.new_tiles(scene)) if is_possible else None
        return self.tiles

    def has_paid(self, scene: Any, integrator: Any, target: Target) -> bool:
        """Whether tiles were used or kept, or would have paid, and enough is or was to be rendered."""
        r = self.renderer
        pixels = pixels_in(r.film.ranges)
        passes = max(self.passes_expected, target.passes(pixels))
        return (self.passes_before + passes) * pixels >= KEPT.pay_from(key_of(r, scene, integrator), LEAST)

    def will_take_tiles(self, integrator: Any, target: Target) -> bool | None:
        """True if they are kept; None if that is not known yet."""
        return True if self.has_paid(self.renderer.kernel_scene(), integrator, target) else self.renderer.use_tiles

    def ended(self) -> None:
        """Note how long was rendered without tiles, and without packets."""
        r = self.renderer
        if self.in_tiles or r.use_tiles is False or r.progress.seconds < NOTED:
            return
        scene = self.prepared_scene()
        if can_take_tiles(r, scene, r.active):
            KEPT.add(key_of(r, scene, r.active), r.progress.seconds)
        used = isinstance(self.eye_rays, PrimaryHits) and self.eye_rays.packets is not None
        if r.jitter and self.may_keep_hits and not used:
            parts = r.scene_data, r.camera, r.sampler
            if have_packets(*parts) and not why_not_kept(*parts, r.film.ranges):
                KEPT.add(key_of_packets(*parts), r.progress.seconds)

    def new_tiles(self, scene: Any) -> Tiles:
        """Tiles, which are watched if the renderer's samples are."""
        r = self.renderer
        KEPT.start(key_of(r, scene, r.active))
        return (Tiles if r.watcher is None else CountedTiles)(r, scene, r.active)

    def tiles_of_view(self) -> ViewTiles | None:
        """What gives the pixels of a view their colours tile by tile, if that is possible."""
        if self.renderer.use_tiles is False or not can_show(self.renderer):
            return None
        if self.view_tiles is None or self.view_tiles.hits is not self.eye_rays:
            self.view_tiles = ViewTiles(self.eye_rays, self.renderer.film.ranges)
        return self.view_tiles

    @property
    def in_tiles(self) -> bool:  # type: ignore[override]
        """Whether samples are taken tile by tile."""
        return self.tiles is not None

    def follow(self, other: Plan) -> None:
        """Take over the choice of packets, and the kept hits of a renderer with the same samples."""
        r, o = self.renderer, other.renderer
        same = r.scene_data is o.scene_data and r.camera is o.camera and r.jitter == o.jitter
        has_shares = r.shares.are_kept or o.shares.are_kept
        are_kept = isinstance(self.eye_rays, PrimaryHits) and isinstance(other.eye_rays, PrimaryHits)
        if same and are_kept and r.film.ranges == o.film.ranges and not has_shares:
            self.eye_rays = other.eye_rays
        elif are_kept:
            self.eye_rays.use_packets = other.eye_rays.use_packets

    def begin_soon(self) -> None:
        """No packets."""
        if isinstance(self.eye_rays, PrimaryHits):
            self.eye_rays.use_packets = False

    def may_become_faster(self) -> bool:
        """Whether packets are possible; they are used as soon as they are worth their compilation."""
        if not (isinstance(self.eye_rays, PrimaryHits) and self.eye_rays.can_use_packets):
            return False
        self.eye_rays.use_packets = None
        return True

    def trace_eye_rays(self, index: int) -> None:
        """Trace them, unless the kept hits belong to this sample."""
        if isinstance(self.eye_rays, PrimaryHits):
            self.eye_rays.bring_up_to_date(self.renderer.seed, index)

    def keep_forms(self) -> None:
        """Packets for large pictures, from the first pass on; none for others."""
        rays = self.eye_rays
        if isinstance(rays, PrimaryHits):
            is_large = not is_small(((0, self.renderer.width), (0, self.renderer.height)))
            rays.use_packets = rays.can_use_packets and is_large

    def eye_passes(self, passes: int) -> int:
        """How often the eye rays were traced: kept hits are traced again only if they change."""
        return self.eye_rays.traces if isinstance(self.eye_rays, PrimaryHits) else passes

    def receipt(self) -> list[str]:
        """One line per form, with the numbers that decided."""
        forms = [self.form]
        if isinstance(self.eye_rays, PrimaryHits):
            forms.append(self.eye_rays.search_form())
        if self.tiles is not None:
            forms.append(TILES)
        elif self.renderer.use_tiles is None and can_take_tiles(
            self.renderer, self.renderer.kernel_scene(), self.renderer.active
        ):
            forms.append(Form("samples", "pixel by pixel", why_no_tiles(self.renderer.progress)))
        return [str(form) for form in forms]
