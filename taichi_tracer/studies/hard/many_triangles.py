"""Lattices, boxes, damaged and crowded meshes, windows of t, and rays that are none."""

import numpy as np

from taichi_tracer.studies.hard import oracle
from taichi_tracer.studies.hard.case import (
    Case,
    CaseRays,
    as_f32,
    box,
    false_hits,
    height_field,
    join,
    not_numbers,
    seconds_of,
    separate,
    sphere,
)

AMONG = 50_000  # copies of a triangle, and triangles with one centroid
DENORMAL = 2.0**-140


def nearest_exactly(rays: CaseRays, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(id, t) of the nearest of all triangles that each ray meets, edges included, of equals the lowest id; −1, ∞."""
    best, best_t = np.full(len(rays), -1), np.full(len(rays), np.inf)
    for i in np.flatnonzero(np.isfinite(corners).all(axis=(1, 2))):
        triangle = corners[i]
        position, t = oracle.exact_hit(rays.origins, rays.directions, np.broadcast_to(triangle, (len(rays), 3, 3)))
        nearer = (position >= 0) & (t > 0) & (t < best_t)
        best[nearer], best_t[nearer] = i, t[nearer]
    return best, best_t


class Exact(Case):
    """Rays whose answer is known in integers. Subclasses say which."""

    stage = "unit"
    most = 600
    is_strict = True  # whether of the triangles at the same t it must be the first

    def with_truth(self, rays: CaseRays) -> CaseRays:
        """The rays, and what they meet."""
        rays = rays[: self.most]
        ids, t = nearest_exactly(rays, self.vertices[self.faces])
        rays.known = {"id": ids, "t": t}
        return rays

    def judge(self, on, rays, epsilon):
        """Hit where the truth says so, the same triangle, and t to rounding."""
        hits = on.intersect(rays)
        ids, truth, true_t = on.own(hits), rays.known["id"], rays.known["t"]
        both = (ids >= 0) & (truth >= 0)
        t_off = np.abs(hits.distance[both].astype(np.float64) / true_t[both] - 1) > 8 * epsilon
        unexpected = np.where(truth != ids, ids, -1)
        other = (ids[both] != truth[both]) & self.is_strict
        return {
            "misses": int(((truth >= 0) & (ids < 0)).sum()),
            "false_hits": false_hits(on, rays, unexpected, epsilon),
            "wrong": int(other.sum() + t_off.sum()),
            "nan": not_numbers(hits),
        }


class Lattice(Exact):
    """Rays from integers to integers, through vertices and the middles of edges.

    Every number is exact and every edge function that should be 0 is 0, so nothing can be put down to rounding: an
    edge belongs to both neighbours, one of which has to answer, and it must always be the same one.
    """

    name = "lattice-exact hits"

    def mesh(self):
        """A height field of 32 triangles."""
        return height_field(self.rng(2), 4, np.array([0.0, 32.0, 0.0]))

    def rays(self, rng, count):
        """The largest component is a power of two, so that quotients by it are exact as well."""
        edge = self.faces[rng.integers(0, len(self.faces), count)]
        p, q = self.vertices[edge[:, 0]], self.vertices[edge[:, 1]]
        target = np.where(rng.uniform(size=(count, 1)) < 0.5, p, (p + q) / 2) + rng.integers(-1, 2, (count, 3)) * [
            1,
            0,
            1,
        ]
        side = rng.choice([-8.0, 8.0], (count, 1))
        directions = np.concatenate([rng.integers(-3, 4, (count, 1)), side, rng.integers(-3, 4, (count, 1))], axis=1)
        return self.with_truth(CaseRays(target - directions, directions))


class AxisParallel(Exact):
    """Rays along an axis, with +0, −0 and denormal numbers in the other two places, in and along the faces of boxes.

    1/0 is infinite, and 0 · ∞ is NaN: for a ray in the plane of a box's face the usual slab test compares with NaN, and
    the box, or the whole scene behind it, is gone. With −0 the near and the far side are swapped. Denormal numbers
    overflow when they are divided by, unless the processor takes them for 0, as Taichi has it do on a CPU.
    """

    name = "axis-parallel rays, slab planes of flat boxes"
    is_strict = False  # a denormal number moves the ray off an edge by less than any rounding

    def mesh(self):
        """A cube, and two squares without any height, whose boxes are flat."""
        cube = box((-2, 62, -2), (2, 66, 2))
        flat = [
            (np.array(c, float), np.array([[0, 1, 2], [0, 2, 3]]))
            for c in (
                [(-2, 69, -2), (-2, 69, 2), (2, 69, 2), (2, 69, -2)],
                [(4, 62, -2), (4, 66, -2), (4, 66, 2), (4, 62, 2)],
            )
        ]
        return join([cube, *flat])

    def rays(self, rng, count):
        """On integers from −3 to 3 about the cube, along each axis both ways."""
        lattice = rng.integers(-3, 4, (count, 3)) + [0, 64, 0]
        axis = rng.integers(0, 3, count)
        sign = rng.choice([-1.0, 1.0], count)
        small = rng.choice([0.0, -0.0, DENORMAL, -DENORMAL], (count, 3))
        origins, directions = lattice.astype(float), small
        rows = np.arange(count)
        origins[rows, axis] = np.where(axis == 1, 64, 0) - 7 * sign
        directions[rows, axis] = sign
        return self.with_truth(CaseRays(origins, directions))


class Damaged(Exact):
    """A cube among triangles without area, with repeated and collinear corners, NaN and infinite ones.

    One NaN makes the box of every node above it NaN, and all of the mesh invisible; a triangle without area divides by
    0. The answers must be those of the cube alone.
    """

    name = "zero-area, NaN and infinite triangles"

    def mesh(self):
        """Good and bad ones in turn; the ids of the good ones stay what they were in the file."""
        vertices, faces = box((30, -2, -2), (34, 2, 2))
        nan, inf = np.nan, np.inf
        bad = [
            [(30, 0, 0), (30, 0, 0), (30, 0, 0)],
            [(29, 0, 0), (29, 0, 0), (35, 1, 0)],
            [(29, -3, -3), (32, 0, 0), (35, 3, 3)],
            [(29, 0, 0), (nan, 0, 0), (29, 1, 0)],
            [(inf, 0, 0), (29, 0, 0), (29, 1, 0)],
            [(29, 0, 0), (29, -inf, 0), (nan, 1, inf)],
        ]
        spoiled = [separate([triangle]) for triangle in bad]
        parts = []
        for k in range(len(faces)):
            parts.append((vertices, faces[k : k + 1]))
            parts.append(spoiled[k % len(spoiled)])
        return join(parts)

    def rays(self, rng, count):
        """Random and lattice rays about the cube."""
        origins = as_f32(
            rng.integers(-3, 4, (count, 3)) + [32, 0, 0] + np.where(np.arange(count)[:, None] % 2, 0, 0.37)
        )
        directions = rng.integers(-4, 5, (count, 3)).astype(float)
        return self.with_truth(CaseRays(origins, directions)[np.abs(directions).max(axis=1) == 4])


class AboutASphere(Case):
    """Rays from around a sphere, towards it. Subclasses say what must hold of them."""

    stage, rays_wanted = "unit", 0.2
    centre: tuple[float, float, float]

    def mesh(self):
        """The sphere."""
        return sphere(12, 7, 2.0, self.centre)

    def rays(self, rng, count):
        """Origins and targets are spread about the centre."""
        origins = as_f32(rng.normal(size=(count, 3)) * 3 + self.centre)
        return CaseRays(origins, as_f32(rng.normal(size=(count, 3)) * 1.5 + self.centre - origins))


class DirectionLengths(AboutASphere):
    """The same rays with directions of length 1e-10 to 1e10.

    A tolerance on the determinant, which grows with |d|, makes short directions miss everything. Lengths are powers of
    two, so that every mode has to give the same answer to the last bit.
    """

    name, centre = "direction lengths 1e-10 to 1e10", (-32, 0, 0)

    def rays(self, rng, count):
        """Each has another length besides."""
        rays = super().rays(rng, count)
        rays.known["scale"] = 2.0 ** rng.integers(-33, 34, count)
        return rays

    def judge(self, on, rays, epsilon):
        """The same triangle, and t over the length the same number."""
        hits, scale = on.intersect(rays), rays.known["scale"]
        scaled = on.intersect(CaseRays(rays.origins, rays.directions * scale[:, None]))
        same_t = (scaled.distance * scale == hits.distance) | ~hits.is_hit
        return {
            "wrong": int(((scaled.triangle_id != hits.triangle_id) | ~same_t).sum()),
            "nan": not_numbers(hits) + not_numbers(scaled),
        }


class Windows(AboutASphere):
    """Hits between t_min and t_max only, both excluded, also where they are the t of a hit.

    To find everything along a ray, one asks again from the last t on. Where the t that is returned is rounded
    otherwise than the one that was compared, the same triangle is found for ever.
    """

    name, centre = "windows of t", (-48, 16, 0)

    def judge(self, on, rays, epsilon):
        """Behind every hit another t, or none; before it nothing; no legal answer from a window that is none."""
        hits = on.intersect(rays)
        t = hits.distance.astype(np.float64)
        behind = on.intersect(rays, t_min=np.where(hits.is_hit, t, np.inf))
        before = on.intersect(rays, t_max=np.where(hits.is_hit, t, 0.0))
        wrong = (behind.is_hit & ~(behind.distance > hits.distance)).sum()
        wrong += (before.is_hit & ~(before.distance < hits.distance)).sum()
        for window in ({"t_min": np.nan}, {"t_max": np.nan}, {"t_min": 1.0, "t_max": 1.0}, {"t_min": np.inf}):
            wrong += on.intersect(rays, **window).is_hit.sum()
        blocked = on.scene.occluded(rays.origins, rays.directions)
        wrong += (blocked != hits.is_hit).sum()
        return {"wrong": int(wrong), "nan": not_numbers(hits) + not_numbers(behind)}


class IllegalRays(AboutASphere):
    """Rays with a zero direction, with NaN or with infinity in any place.

    Every comparison with NaN is false: "not outside" takes it for a hit, and a traversal that skips a box only when
    the ray is surely outside visits the whole tree for it.
    """

    name, centre, rays_wanted = "zero, NaN and infinite rays", (-64, 0, 0), 1.0

    def rays(self, rng, count):
        """They would hit the sphere, but each has one illegal number in one of six places, or no direction."""
        origins, directions = np.tile([-64.0, 0, 0], (count, 1)), as_f32(rng.normal(size=(count, 3)))
        rows, place, value = np.arange(count), rng.integers(0, 7, count), rng.choice([np.nan, np.inf, -np.inf], count)
        origins[rows[place < 3], place[place < 3]] = value[place < 3]
        at = (place >= 3) & (place < 6)
        directions[rows[at], place[at] - 3] = value[at]
        directions[place == 6] = rng.choice([0.0, -0.0], ((place == 6).sum(), 3))
        return CaseRays(origins, directions)

    def judge(self, on, rays, epsilon):
        """All miss, at once."""
        hits = on.intersect(rays)
        legal = CaseRays(
            np.broadcast_to([-64.0, 0, 0], rays.origins.shape), as_f32(self.rng(3).normal(size=rays.origins.shape))
        )
        of_legal = seconds_of(lambda: on.scene.intersect(legal.origins, legal.directions))
        of_illegal = seconds_of(lambda: on.scene.intersect(rays.origins, rays.directions))
        is_wrong = hits.is_hit | (hits.triangle_id != -1) | (hits.distance != np.inf)
        blocked = on.scene.occluded(rays.origins, rays.directions)
        return {
            "wrong": int(is_wrong.sum() + blocked.sum()),
            "nan": int(np.isnan(hits.distance).sum() + np.isnan(hits.normal).sum()),
            "slow": int(of_illegal > 2.5 * of_legal + 1e-3) * len(rays),
        }


class Duplicates(Case):
    """50,000 copies of one triangle.

    All centroids are the same: a tree that splits space in the middle never gets them apart, and recursion without an
    end is the usual result. All t are the same, and the answer must not depend on the order of the tree.
    """

    name, stage, rays_wanted = "50,000 copies of a triangle", "crowd", 0.005

    def mesh(self):
        """The same three vertices, again and again."""
        return np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0.5]]), np.tile([[0, 1, 2]], (AMONG, 1))

    def rays(self, rng, count):
        """At the inside."""
        origins = as_f32(rng.uniform(-1, 1, (count, 3)) + [0, 0, 3])
        target = rng.dirichlet((2, 2, 2), count) @ self.vertices
        return CaseRays(origins, as_f32(target - origins))

    def judge(self, on, rays, epsilon):
        """The first copy answers, always."""
        hits = on.intersect(rays)
        ids = on.own(hits)
        return {"misses": int((ids < 0).sum()), "wrong": int((ids > 0).sum()), "nan": not_numbers(hits)}


class OneCentroid(Case):
    """50,000 different triangles whose boxes all have the same centre: nothing to split by, and every box overlaps."""

    name, stage, rays_wanted = "50,000 triangles with one centroid", "crowd", 0.005

    def mesh(self):
        """Corners at −h, h and (h, −h, h) of half sizes h on a grid of 2⁻¹⁰."""
        half = np.round(self.rng(2).uniform(0.1, 1, (AMONG, 3)) * 1024) / 1024
        corners = np.stack([-half, half, half * [1, -1, 1]], axis=1)
        return separate(corners + [64, 0, 0])

    def rays(self, rng, count):
        """From around the centre, outwards and through it; what they meet is computed in float64."""
        count = min(count, 100)
        origins = as_f32(rng.normal(size=(count, 3)) * 2 + [64, 0, 0])
        directions = as_f32(rng.normal(size=(count, 3)) * 0.5 + [64, 0, 0] - origins)
        nearest = np.full(count, np.inf)
        corners = self.vertices[self.faces]
        for i in range(count):
            o, d = (np.broadcast_to(a[i], (len(corners), 3)) for a in (origins, directions))
            with np.errstate(all="ignore"):
                n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
                t = oracle.dot(corners[:, 0] - o, n) / oracle.dot(d, n)
                surely = (oracle.margin(o, d, corners) > 1e-4) & (t > 0)
            nearest[i] = t[surely].min(initial=np.inf)
        return CaseRays(origins, directions, known={"t": nearest})

    def judge(self, on, rays, epsilon):
        """Nothing that is surely hit is passed over."""
        hits = on.intersect(rays)
        late = hits.distance.astype(np.float64) > rays.known["t"] * (1 + 1e-4)
        ids = on.own(hits)
        return {"misses": int(late.sum()), "false_hits": false_hits(on, rays, ids, epsilon), "nan": not_numbers(hits)}
