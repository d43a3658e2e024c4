"""Views from kept hits, tile by tile: the rays of sixteen pixels are made at once, each pixel is shaded with its own.

The plain form makes the ray of each pixel again, and computes from its column and its row where its hit is kept. For a
view, this takes more time than the shading itself. Here, a thread goes through the tiles in the order of the memory.
The picture has the same bits.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import LANES, Turns, lanes
from taichi_tracer.fast.packets import TILE, TILE_BITS
from taichi_tracer.fast.pixel_lanes import generate_rays
from taichi_tracer.fast.primary_hits import PrimaryHits
from taichi_tracer.ray import Ray
from taichi_tracer.system import memory
from taichi_tracer.system.varying import varying

PIECE = 64  # tiles that a thread takes at a time


def can_show(renderer) -> bool:
    """Whether the picture of a renderer is a view of kept hits that were traced in packets.

    Before that, the picture is small, or it is the first one; then a further kernel is not worth its compilation.
    """
    hits = renderer.eye_rays
    are_in_packets = isinstance(hits, PrimaryHits) and hits.packets is not None
    return are_in_packets and not renderer.is_random and renderer.watcher is None


@ti.data_oriented
class ViewTiles:
    """Gives each pixel of a view its colour.

    Fields of a place, sixteen lanes each: o and d, for each axis, the origins and the directions of the rays of a tile.

    Args:
        hits: the kept hits, for which ``can_show`` holds.
        ranges: as for ``PrimaryHits``.
    """

    def __init__(self, hits: PrimaryHits, ranges: tuple[tuple[int, int], tuple[int, int]]) -> None:
        self.hits = hits
        (self.x0, self.x1), (self.y0, self.y1) = ranges
        self.first = varying((self.x0 // TILE, self.y0 // TILE))
        across, upwards = -(-self.x1 // TILE) - self.first[0], -(-self.y1 // TILE) - self.first[1]
        self.across, self.upwards = varying((across, upwards))
        self.turns = Turns(-(-self.across * self.upwards // PIECE))
        self._memory = memory.Memory(scratch="ViewTiles")
        self.o, self.d = (ti.Vector.field(LANES, float) for _ in range(2))
        self._memory.fields.dense(ti.ij, (self.turns.places, 3)).place(self.o, self.d)
        self._memory.allocate()

    @ti.kernel
    def take(
        self, renderer: ti.template(), scene: ti.template(), integrator: ti.template(), seed: ti.u32, index: ti.u32
    ):
        """Give the film the value of every pixel, as ``ProgressiveRenderer._take_samples`` does."""
        self.turns.begin()
        for iteration in range(self.turns.iterations):
            c, piece = self.turns.place_and_piece(iteration)
            while piece < self.turns.pieces:
                for k in range(piece * PIECE, ti.min((piece + 1) * PIECE, self.across * self.upwards)):
                    tile_x, tile_y = self.first[0] + k // self.upwards, self.first[1] + k % self.upwards
                    self.make_rays(c, tile_x, tile_y)
                    first_x, first_y = tile_x * TILE, tile_y * TILE
                    for x in range(ti.max(first_x, self.x0), ti.min(first_x + TILE, self.x1)):
                        for y in range(ti.max(first_y, self.y0), ti.min(first_y + TILE, self.y1)):
                            lane = ((x - first_x) << TILE_BITS) + y - first_y
                            ray = Ray(origin=self.vector(self.o, c, lane), direction=self.vector(self.d, c, lane))
                            hit = self.hits.hit_in(tile_x * self.hits.tiles_y + tile_y, lane, ray)
                            rng = renderer.sampler.start(seed, x, y, index)
                            renderer.record(x, y, renderer.radiance(scene, integrator, ray, hit, rng), index)
                piece = self.turns.next_piece()

    @ti.func
    def make_rays(self, c, tile_x, tile_y):
        """Make the rays through the centres of the pixels of a tile."""
        x = ti.Vector([tile_x * TILE + lane // TILE for lane in range(LANES)])
        y = ti.Vector([tile_y * TILE + lane % TILE for lane in range(LANES)])
        ox, oy, oz, dx, dy, dz = generate_rays(self.hits.lanes, self.hits.camera, x, y, lanes(0.5), lanes(0.5))
        self.o[c, 0], self.o[c, 1], self.o[c, 2] = lanes(ox), lanes(oy), lanes(oz)
        self.d[c, 0], self.d[c, 1], self.d[c, 2] = lanes(dx), lanes(dy), lanes(dz)

    @ti.func
    def vector(self, components: ti.template(), c, lane):
        """A lane of three components."""
        return tm.vec3(components[c, 0][lane], components[c, 1][lane], components[c, 2][lane])
