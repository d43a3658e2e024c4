"""The hits of the eye rays: a kernel finds them once, and every view and every estimator uses them."""

import math

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.camera import ProjectiveCamera
from taichi_tracer.fast.kept_forms import KEPT, Least, key_of_packets
from taichi_tracer.fast.lanes import LANES, Turns, lanes
from taichi_tracer.fast.nearest import FastBruteForce, FastIntersector
from taichi_tracer.fast.packet_shapes import sphere_normals
from taichi_tracer.fast.packets import SIDE, SIDE_BITS, TILE, TILE_BITS, Packets
from taichi_tracer.fast.pixel_lanes import FIRST_DIMENSION, generate_rays, has_points, lanes_of, pairs_of
from taichi_tracer.fast.wide_bvh import WideBVH
from taichi_tracer.forms import Form
from taichi_tracer.formulas.triangles import TriangleTest
from taichi_tracer.picture.adaptive import Shares
from taichi_tracer.ray import no_hit
from taichi_tracer.sampler import DEFAULT_SAMPLER, Sampler, sampler_of
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.registry import PARTS
from taichi_tracer.system.varying import varying

PIECE = 16  # packets that a thread takes at a time: neighbours, which meet the same nodes
LARGE_PICTURE = 256 * 256  # pixels; from this size on, packets gain much
# A picture that is known to need fewer rays uses no packets, and a smaller view uses packets only after so many. New
# ones take up to three seconds to compile, and kept ones a quarter of a second to start; they take a third to a half of
# a second less for four million rays.
MANY_RAYS = Least(started=1 << 20, kept=1 << 22, new=1 << 25)
# Tests of a ray and a primitive that take less time than it takes to translate the search of a tree.
FEW_TESTS = 1 << 24
FEWEST_PLACES = 1 << 14  # for tiles: those of a picture of 512 × 512 pixels
CROWD = 8  # triangles per pixel; see ``is_crowded``


@ti.data_oriented
class PrimaryHits:
    """t, triangle id and barycentric coordinates (u, v) of the nearest hit of every pixel; id −1 if there is no hit.

    The pixels are stored in tiles of 4 × 4, one lane for each pixel. There are two forms with the same bits: single
    rays; and packets, on a CPU, if camera, sampler and intersector have a form for them. Packets are several times as
    fast and take longer to compile.

    Args:
        scene_data: the ``SceneData``.
        camera: the camera that makes the rays.
        jitter: whether rays pass through a random point of their pixel instead of its centre (A2-1).
        samples: the sampler that gives the random point; None takes Sobol' points.
        use_packets: whether to use packets; None uses them if they exist and are worth their compilation.
        shares: how often each pixel takes a sample, see ``picture.adaptive``.
        ranges: ((x0, x1), (y0, y1)), the pixels that are traced; packets trace whole tiles. None traces all pixels.
    """

    def __init__(
        self,
        scene_data,
        camera: ProjectiveCamera,
        jitter: bool = False,
        samples: Sampler | None = None,
        use_packets: bool | None = None,
        shares: Shares | None = None,
        ranges: tuple[tuple[int, int], tuple[int, int]] | None = None,
    ) -> None:
        self.scene_data, self.camera, self.jitter = scene_data, camera, jitter
        self.sampler = sampler_of(PARTS.find("sampler", DEFAULT_SAMPLER), camera) if samples is None else samples
        self.shares = Shares(camera.width, camera.height) if shares is None else shares
        self.width, self.height = camera.width, camera.height
        self.lanes = lanes_of(camera)
        self.has_groups = self.lanes is not None  # whether the rays of a tile can be computed together
        self.share_origin = self.has_groups and self.lanes.share_origin  # whether all rays start at the same point
        self.keeps_normals = scene_data.geometry.effects.spheres  # of spheres: together, they are found sooner
        self.can_use_packets = have_packets(scene_data, camera, self.sampler)
        self.use_packets = use_packets
        self.is_long = False  # whether it is known that the picture takes long enough for every form
        # How often rays are to be traced until this picture is complete: 1 if nobody knows, ∞ if time or error ends it.
        self.passes = 1.0
        self.packets = None
        self.traces, self.forms = 0, frozenset()  # how often rays were traced, and in which forms
        side = SIDE * TILE  # of a packet, in pixels
        self.tiles_x = varying(-(-self.width // side) * SIDE)
        self.tiles_y = varying(-(-self.height // side) * SIDE)
        self.ranges = varying(((0, self.width), (0, self.height)) if ranges is None else ranges)
        self.pixels = pixels_in(self.ranges)
        (x0, x1), (y0, y1) = self.ranges
        self.without_tree = self._search_without_tree()
        self.first = varying((x0 // side, y0 // side))  # of the packets that are traced
        self.across, self.upwards = varying((-(-x1 // side) - x0 // side, -(-y1 // side) - y0 // side))
        self._memory: memory.Memory | None = None
        self._sample = 0, 0  # the seed and the index of the sample that was traced last
        self._traced = None  # the camera, and with jitter the sample, to which the hits belong

    def _search_without_tree(self) -> FastBruteForce | None:
        """The search of every primitive. It has the bits of the tree's and is translated in half of the time."""
        geometry, of_scene = self.scene_data.geometry, self.scene_data.ray_intersector
        if self.jitter or type(of_scene) is not WideBVH:
            return None
        return FastBruteForce(geometry, TriangleTest(of_scene.triangle_test, of_scene.solve))

    def searcher(self) -> FastIntersector:
        """What single rays search: every primitive while that is little work in all; otherwise the scene's tree."""
        tests = self.traces * self.pixels * self.scene_data.geometry.n_primitives
        is_little = self.without_tree is not None and tests <= FEW_TESTS
        return self.without_tree if is_little else self.scene_data.ray_intersector

    def _allocate(self, for_packets: bool) -> None:
        """Make the fields, when they are needed for the first time: another form of the rays may be chosen before.

        Packets write whole vectors, which is faster into Taichi's own fields. These have room for a power of two, so
        that a picture of similar size finds the kept kernels.
        """
        self._memory = memory.Memory(scratch="PrimaryHits" if for_packets else "")
        places = max(FEWEST_PLACES, 1 << (self.tiles_x * self.tiles_y - 1).bit_length())
        self.distance, self.u, self.v = (ti.Vector.field(LANES, float) for _ in range(3))
        self.triangle_id = ti.Vector.field(LANES, ti.i32)
        fields = [self.distance, self.triangle_id, self.u, self.v]
        if self.jitter:  # the rays are kept, because computing them again costs more than reading them
            self.direction = [ti.Vector.field(LANES, float) for _ in range(3)]
            self.origin = [] if self.share_origin else [ti.Vector.field(LANES, float) for _ in range(3)]
            fields += self.direction + self.origin
        self.normal = [ti.Vector.field(LANES, float) for _ in range(3)] if self.keeps_normals else []
        fields += self.normal
        for field in fields:
            self._memory.fields.dense(ti.i, places).place(field)
        self._memory.allocate()

    def bring_up_to_date(self, seed: int, index: int) -> None:
        """Trace, unless the hits belong to this sample. Without jitter, hits are valid until the camera moves."""
        wanted = (self.camera.version, *((seed, index, self.shares.version) if self.jitter else ()))
        if self._traced != wanted or self._memory is None or not self._memory.is_claimed():
            self.trace(seed, index)
            self._traced = wanted

    def trace(self, seed: int = 0, index: int = 0) -> None:
        """Send one eye ray through every pixel; with jitter, the ray of one sample."""
        use_packets = self.can_use_packets and self.is_much_work() if self.use_packets is None else self.use_packets
        if self._memory is None or (use_packets and self._memory.has_arrays):
            self._allocate(use_packets)
        self._memory.claim()
        self._sample = seed, index
        self.traces += 1
        self.forms |= {use_packets}
        if not use_packets:
            self._trace_rays(self.searcher(), seed, index)
            return
        if self.packets is None:
            KEPT.start(key_of_packets(self.scene_data, self.camera, self.sampler))
            has_spheres = self.scene_data.geometry.effects.spheres
            self.turns = Turns(-(-self.across * self.upwards // PIECE))
            self.packets = Packets(self.turns.places, self.lanes.share_origin, has_spheres)
        self._trace_packets(seed, index)

    def is_much_work(self) -> bool:
        """Whether packets are worth the seconds of their compilation.

        They are for large pictures: from the first pass on if many are to come, otherwise from the second one on.
        """
        if is_crowded(self.scene_data, self.camera):
            return False
        if self.is_long:
            return True
        many = many_rays(self.scene_data, self.camera, self.sampler)
        if is_small(self.ranges):
            return self.pixels * self.traces >= many
        is_short = self.traces < self.passes and self.pixels * self.passes < many
        if self.jitter and self.passes > 1:  # samples that were asked for together; no window waits for the next one
            is_short = self.pixels * max(self.traces, self.passes) < many
        comes_again = self.traces > 0 or (self.jitter and self.passes > 1)
        return comes_again and not is_short

    def search_form(self) -> Form:
        """How the hits are found, for receipts."""
        if self.packets is not None:
            return Form("their search", "in packets", f"{self.traces:,} × {self.pixels:,} rays so far", True)
        why = (
            f"{self.traces:,} × {self.pixels:,} rays so far; packets are worth their start from "
            f"{many_rays(self.scene_data, self.camera, self.sampler):,} on"
        )
        if not self.can_use_packets:
            why = "camera, sampler or intersector has no packets"
        elif is_crowded(self.scene_data, self.camera):
            why = f"more than {CROWD} triangles for each pixel"
        elif not is_small(self.ranges):
            why += ", or from the second picture of a window on"
        return Form("their search", "one by one", why)

    def to_image(self, name: str) -> np.ndarray:
        """(height, width) of "distance", "triangle_id", "u" or "v", top row first."""
        return self.image_of(getattr(self, name))

    def image_of(self, field) -> np.ndarray:
        """(height, width) of one of the fields, top row first."""
        if self._memory is not None and not self._memory.is_claimed():
            self.trace(*self._sample)
        tiles = field.to_numpy()[: self.tiles_x * self.tiles_y].reshape(self.tiles_x, self.tiles_y, TILE, TILE)
        padded = tiles.transpose(1, 3, 0, 2).reshape(self.tiles_y * TILE, self.tiles_x * TILE)
        return padded[: self.height, : self.width][::-1]

    @ti.func
    def tile_and_lane(self, x, y):
        """The tile and the lane of a pixel."""
        return (x >> TILE_BITS) * self.tiles_y + (y >> TILE_BITS), (x & (TILE - 1)) * TILE + (y & (TILE - 1))

    @ti.func
    def keep_vector(self, components: ti.template(), tile, lane, vector):
        """Keep a vector of one pixel."""
        for axis in ti.static(range(3)):
            components[axis][tile][lane] = vector[axis]

    @ti.func
    def keep_lanes(self, components: ti.template(), tile, x, y, z):
        """Keep the vectors of a tile: three components, each sixteen lanes or one common number."""
        components[0][tile], components[1][tile], components[2][tile] = lanes(x), lanes(y), lanes(z)

    @ti.func
    def vector(self, components: ti.template(), tile, lane):
        """A lane of three components."""
        return tm.vec3(components[0][tile][lane], components[1][tile][lane], components[2][tile][lane])

    @ti.func
    def hit_of(self, x, y, rng):
        """(ray, HitData) of a pixel, from the kept hits. The pixel's pair of random numbers was already used there."""
        rng.skip_2d()
        tile, lane = self.tile_and_lane(x, y)
        ray = self.camera.generate_ray(x, y, self.jitter, tm.vec2(0.5))
        if ti.static(self.jitter):  # then only the common origin of this ray is used, and only it is computed
            ray.direction = self.vector(self.direction, tile, lane)
            if ti.static(not self.share_origin):
                ray.origin = self.vector(self.origin, tile, lane)
        return ray, self.hit_in(tile, lane, ray)

    @ti.kernel
    def _trace_rays(self, searcher: ti.template(), seed: ti.u32, index: ti.u32):
        for x, y in ti.ndrange(*self.ranges):
            tile, lane = self.tile_and_lane(x, y)
            xi = tm.vec2(0.5)
            if ti.static(self.jitter):
                i, _ = self.shares.sample_of(x, y, index)
                xi = self.sampler.start(seed, x, y, i).next_2d()
            ray = self.camera.generate_ray(x, y, self.jitter, xi)
            if ti.static(self.jitter):
                self.keep_vector(self.direction, tile, lane, ray.direction)
                if ti.static(not self.share_origin):
                    self.keep_vector(self.origin, tile, lane, ray.origin)
            t, triangle_id, u, v = searcher.nearest(ray, 0.0, tm.inf)
            self.distance[tile][lane], self.triangle_id[tile][lane] = t, triangle_id
            self.u[tile][lane], self.v[tile][lane] = u, v
            if ti.static(self.keeps_normals):
                self.keep_vector(self.normal, tile, lane, searcher.outward_of(ray, t, triangle_id))

    @ti.kernel
    def _trace_packets(self, seed: ti.u32, index: ti.u32):
        self.turns.begin()
        for iteration in range(self.turns.iterations):
            c, piece = self.turns.place_and_piece(iteration)
            while piece < self.turns.pieces:
                for k in range(piece * PIECE, ti.min((piece + 1) * PIECE, self.across * self.upwards)):
                    first_x, first_y = self.first[0] + k // self.upwards, self.first[1] + k % self.upwards
                    if self.is_asked_for(first_x, first_y, index):
                        self.trace_packet(c, first_x, first_y, seed, index)
                piece = self.turns.next_piece()

    @ti.func
    def is_asked_for(self, packet_x, packet_y, index):
        """Whether any group of a packet takes a sample in this pass."""
        is_asked = not self.shares.are_kept
        if ti.static(self.shares.are_kept):
            for g in range(self.packets.groups[None]):
                tile_x, tile_y = packet_x * SIDE + (g >> SIDE_BITS), packet_y * SIDE + (g & (SIDE - 1))
                if tile_x * TILE < self.width and tile_y * TILE < self.height:
                    is_asked = is_asked or self.shares.takes_group(tile_x, tile_y, index)
        return is_asked

    @ti.func
    def trace_packet(self, c, packet_x, packet_y, seed, index):
        """Trace the eye rays of a packet, and keep their hits."""
        origin = tm.vec3(0)
        for g in range(self.packets.groups[None]):
            tile_x, tile_y = packet_x * SIDE + (g >> SIDE_BITS), packet_y * SIDE + (g & (SIDE - 1))
            origin = self.put_rays(c, g, tile_x, tile_y, seed, index)
        self.scene_data.ray_intersector.trace_packet(self.packets, c, origin, 0.0)
        for g in range(self.packets.groups[None]):
            tile_x, tile_y = packet_x * SIDE + (g >> SIDE_BITS), packet_y * SIDE + (g & (SIDE - 1))
            tile = tile_x * self.tiles_y + tile_y
            self.distance[tile] = self.packets.t[c, g]
            self.triangle_id[tile] = self.packets.triangle_id[c, g]
            self.u[tile] = self.packets.u[c, g]
            self.v[tile] = self.packets.v[c, g]
            if ti.static(self.keeps_normals):
                self.find_normals(c, g, tile, origin)

    @ti.func
    def pixels_of(self, tile_x, tile_y):
        """x and y of the pixels of a tile; of those beyond the picture, those of the nearest pixel."""
        x = ti.Vector([ti.min(tile_x * TILE + lane // TILE, self.width - 1) for lane in range(LANES)])
        y = ti.Vector([ti.min(tile_y * TILE + lane % TILE, self.height - 1) for lane in range(LANES)])
        return x, y

    @ti.func
    def put_rays(self, c, g, tile_x, tile_y, seed, index):
        """Put the eye rays of a tile into a group of a packet. Returns their origin, if they share it."""
        tile = tile_x * self.tiles_y + tile_y
        x, y = self.pixels_of(tile_x, tile_y)
        xi_x, xi_y = lanes(0.5), lanes(0.5)
        if ti.static(self.jitter):
            xi_x, xi_y = pairs_of(self.sampler, self.shares, tile_x * TILE, tile_y * TILE, seed, index, FIRST_DIMENSION)
        ox, oy, oz, dx, dy, dz = generate_rays(self.lanes, self.camera, x, y, xi_x, xi_y)
        if ti.static(self.jitter):
            self.keep_lanes(self.direction, tile, dx, dy, dz)
            if ti.static(not self.share_origin):
                self.keep_lanes(self.origin, tile, ox, oy, oz)
        self.packets.put_rays(c, g, ox, oy, oz, dx, dy, dz)
        origin = tm.vec3(0)
        if ti.static(self.lanes.share_origin):
            origin = tm.vec3(ox, oy, oz)
        return origin

    @ti.func
    def find_normals(self, c, g, tile, origin):
        """Keep ``outward_of`` the hits of a group, if there are spheres among them."""
        ids = self.packets.triangle_id[c, g]
        x, y, z, radius, spheres = lanes(0.0), lanes(0.0), lanes(0.0), lanes(1.0), 0
        for lane in range(LANES):
            if ids[lane] >= 0:  # first: Taichi evaluates both sides of an "and"
                if self.scene_data.ray_intersector.is_sphere(ids[lane]):
                    centre, radius[lane] = self.scene_data.ray_intersector.sphere(ids[lane])
                    x[lane], y[lane], z[lane] = centre.x, centre.y, centre.z
                    spheres += 1
        if spheres > 0:
            ox, oy, oz = lanes(origin.x), lanes(origin.y), lanes(origin.z)
            if ti.static(not self.share_origin):
                ox, oy, oz = self.packets.o[c, g, 0], self.packets.o[c, g, 1], self.packets.o[c, g, 2]
            dx, dy, dz = self.packets.d[c, g, 0], self.packets.d[c, g, 1], self.packets.d[c, g, 2]
            nx, ny, nz = sphere_normals(ox, oy, oz, dx, dy, dz, x, y, z, radius, self.packets.t[c, g])
            self.keep_lanes(self.normal, tile, nx, ny, nz)

    @ti.func
    def hits_nothing(self, tile_x, tile_y):
        """Whether the rays of all pixels of a tile hit nothing. A pixel that is not traced counts as one that hits."""
        return self.triangle_id[tile_x * self.tiles_y + tile_y].max() < 0

    @ti.func
    def directions_of(self, tile_x, tile_y):
        """The components of the directions of the rays of a tile, which must have ``has_groups``."""
        tile = tile_x * self.tiles_y + tile_y
        dx, dy, dz = lanes(0.0), lanes(0.0), lanes(0.0)
        if ti.static(self.jitter):
            dx, dy, dz = self.direction[0][tile], self.direction[1][tile], self.direction[2][tile]
        else:
            x, y = self.pixels_of(tile_x, tile_y)
            _, _, _, x_of, y_of, z_of = generate_rays(self.lanes, self.camera, x, y, lanes(0.5), lanes(0.5))
            dx, dy, dz = lanes(x_of), lanes(y_of), lanes(z_of)
        return dx, dy, dz

    @ti.func
    def hit_in(self, tile, lane, ray):
        """The HitData of the eye ray in a lane of a tile."""
        data = no_hit()
        triangle_id = self.triangle_id[tile][lane]
        if triangle_id >= 0:
            t, u, v = self.distance[tile][lane], self.u[tile][lane], self.v[tile][lane]
            outward = tm.vec3(0)
            if ti.static(self.keeps_normals):
                outward = self.vector(self.normal, tile, lane)
            data = self.scene_data.ray_intersector.describe_with(ray, t, triangle_id, u, v, outward)
        return data


def pixels_in(ranges: tuple[tuple[int, int], tuple[int, int]]) -> int:
    """The number of pixels that are traced; ``ranges`` as for ``PrimaryHits``."""
    (x0, x1), (y0, y1) = ranges
    return (x1 - x0) * (y1 - y0)


def is_small(ranges: tuple[tuple[int, int], tuple[int, int]]) -> bool:
    """Whether a picture has so few pixels that packets gain little; ``ranges`` as for ``PrimaryHits``."""
    return pixels_in(ranges) < LARGE_PICTURE


def is_crowded(scene_data, camera: ProjectiveCamera) -> bool:
    """Whether there are so many triangles for each pixel that neighbouring rays have too little in common."""
    return scene_data.geometry.n_primitives > CROWD * camera.width * camera.height


def have_packets(scene_data, camera: ProjectiveCamera, sampler: Sampler) -> bool:
    """Whether camera, sampler and intersector have a form for packets."""
    has_form = lanes_of(camera) is not None and has_points(sampler)
    has_search = getattr(scene_data.ray_intersector, "solve_packet", None) is not None
    return runtime.can("lanes") and has_form and has_search


def many_rays(scene_data, camera: ProjectiveCamera, sampler: Sampler) -> float:
    """From how many rays on packets gain more than it takes to start them."""
    if not have_packets(scene_data, camera, sampler):
        return MANY_RAYS.new
    return KEPT.pay_from(key_of_packets(scene_data, camera, sampler), MANY_RAYS)


def why_not_kept(scene_data, camera: ProjectiveCamera, sampler: Sampler, ranges, passes: float = math.inf) -> str:
    """Why a picture with new rays in each pass does not keep their hits; "" if it does.

    The hits of such rays are used once. To write and to read them pays only if packets find them.

    Args:
        ranges: as for ``PrimaryHits``. passes: how often its rays are traced; ∞ if this is unknown.
    """
    if is_small(ranges):
        return "new rays in each pass, and the picture is too small for packets"
    if pixels_in(ranges) * passes < many_rays(scene_data, camera, sampler):
        return "new rays in each pass, and too few for packets"
    if is_crowded(scene_data, camera):
        return f"new rays in each pass, and more than {CROWD} triangles for each pixel"
    if runtime.can("lanes") and not have_packets(scene_data, camera, sampler):
        return "new rays in each pass, and they have no packets"
    return ""
