"""Samples of whole tiles whose near misses are counted: what a look-up counts for waits beside its term."""

from typing import Any

import taichi as ti

from taichi_tracer.fast.tiles import Tiles
from taichi_tracer.unseen.near_misses import EYE


@ti.data_oriented
class CountedTiles(Tiles):
    """Tiles that tell the counter of near misses what they find.

    Fields of a term in each place: kind: of its look-up; code: what it counts for; see ``NearMissCounter``.
    """

    def __init__(self, renderer: Any, scene: Any, integrator: Any) -> None:
        self.counter = renderer.watcher
        super().__init__(renderer, scene, integrator)

    def watch_terms(self, place: ti.SNode, most: int) -> None:
        """Place ``kind`` and ``code``, of at most so many terms."""
        self.kind, self.code = ti.field(ti.i32), ti.field(ti.i32)
        place.dense(ti.j, most).place(self.kind, self.code)

    @ti.func
    def term_waits(self, c, k):
        """Note the kind of the look-up."""
        self.kind[c, k] = self.counter.kind_before_weight()

    @ti.func
    def term_is_found(self, c, k, factor, light):
        """Note what it counts for, if nothing blocks it."""
        u, v = self.look_ups.coords(c, k)
        self.code[c, k] = self.counter.code(self.counter.weighted(self.kind[c, k], factor), u, v, light)

    @ti.func
    def term_is_added(self, c, k, x, y):
        """Count it."""
        self.counter.count(x, y, self.code[c, k])

    @ti.func
    def background_is_added(self, c, k, x, y, light):
        """Count the look-up of an eye ray."""
        u, v = self.look_ups.coords(c, k)
        self.counter.count(x, y, self.counter.code(EYE, u, v, light))
