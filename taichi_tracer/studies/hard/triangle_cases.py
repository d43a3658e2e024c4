"""Hard cases of rays and triangles: exact t, closed surfaces, and meshes in which a hit is hard to find."""

import numpy as np

from taichi_tracer.contracts.lab import as_f32, separate, sphere
from taichi_tracer.studies.hard import oracle
from taichi_tracer.studies.hard.case import (
    Case,
    CaseInScene,
    CaseRays,
    box,
    edges_of,
    false_hits,
    height_field,
    join,
    joined,
    normals_of,
    not_numbers,
    seconds_of,
    unit_rows,
)

SURELY_INSIDE = 0.05  # barycentric coordinates above it leave no doubt that the ray hits
MOST_EXACT = 400  # rays whose t is computed in integers, which takes 0.1 ms each


class DistanceCase(Case):
    """How far t is from the truth, on rays through the inside of triangles. Subclasses say which."""

    stage = "unit"
    num_triangles = 64
    rays_wanted = 0.1
    exponents = -0.3, 0.3  # of the distance of an origin

    def triangles(self, rng) -> np.ndarray:
        """(n, 3, 3) corners."""
        return rng.uniform(-1, 1, (self.num_triangles, 3, 3))

    def aim(self, rng, corners: np.ndarray, target: np.ndarray, n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Origins and directions towards ``target``, on triangles with the unit normal ``n``.

        Here, rays meet the plane at more than 17 degrees.
        """
        away = unit_rows(rng.normal(size=n.shape))
        away = np.where(np.abs((away * n).sum(axis=1, keepdims=True)) < 0.3, n, away)
        origin = as_f32(target + away * 10.0 ** rng.uniform(*self.exponents, (len(n), 1)))
        return origin, target - origin

    def mesh(self):
        """Triangles that share no vertex; they may lie across each other, since each is asked alone."""
        return separate(self.triangles(self.rng(2)))

    def rays(self, rng, count):
        """Three times as many are aimed; those that are surely inside are kept, with their exact t."""
        count = min(count, MOST_EXACT)
        ids = rng.integers(0, len(self.faces), 3 * count)
        corners = self.vertices[self.faces[ids]]
        weights = rng.dirichlet((3, 3, 3), len(ids))
        target = (corners * weights[:, :, None]).sum(axis=1)
        n = unit_rows(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
        origins, directions = (as_f32(a) for a in self.aim(rng, corners, target, n))
        inside = np.flatnonzero(oracle.margin(origins, directions, corners) > SURELY_INSIDE)[:count]
        rays = CaseRays(origins, directions, known={"ids": ids})[inside]
        position, rays.known["t"] = oracle.exact_hit(rays.origins, rays.directions, corners[inside])
        return rays[(position == 1) & (rays.known["t"] > 0)]

    def judge(self, on, rays, epsilon):
        """Every ray must hit; the finding is the relative error of t."""
        on.intersect(rays)
        t, truth = on.meet(rays, rays.known["ids"]).astype(np.float64), rays.known["t"]
        hit = np.isfinite(t)
        error = np.abs(t[hit] / truth[hit] - 1)
        worst = float(error.max()) if len(error) > 0 else 0.0
        return {"misses": int((~hit & ~np.isnan(t)).sum()), "nan": int(np.isnan(t).sum()), self.measure: worst}


class UnitTriangles(DistanceCase):
    """Triangles and distances of about 1: what every test should get right to the last digits."""

    name, measure = "t: unit triangles", "t_unit"


class Slivers(DistanceCase):
    """Triangles 1 long and down to 1e-6 wide.

    Their two long edges are almost parallel, and the cross product of these loses the digits that say where the plane
    is: t is off by whole percents. From the two shortest edges it is not.
    """

    name, measure = "t: slivers to aspect 1e6", "t_sliver"

    def triangles(self, rng):
        """Aspect 10^0 to 10^6; the width is at right angles to the length."""
        along = unit_rows(rng.normal(size=(self.num_triangles, 3)))
        across = unit_rows(np.cross(along, rng.normal(size=along.shape)))
        width = 10.0 ** -np.linspace(0, 6, self.num_triangles)[:, None]
        # At a corner where f32 has digits left for a width of 1e-6: close to 0 in the direction of the width.
        corner = -along * rng.uniform(0.2, 0.8, (self.num_triangles, 1))
        return np.stack([corner, corner + along, corner + along * 0.5 + across * width], axis=1)

    def aim(self, rng, corners, target, n):
        """Rays come from about 1 away, near the normal."""
        away = unit_rows(n + 0.3 * rng.normal(size=n.shape))
        origin = as_f32(target + away * rng.uniform(0.5, 2, (len(n), 1)))
        return origin, target - origin


class Grazing(DistanceCase):
    """Rays almost parallel to the plane, to 1e-6 rad.

    The determinant is a small difference of large products, and t is divided by it. Seen along a floor, textures
    tremble and shadows detach.
    """

    name, measure = "t: grazing to 1e-6 rad", "t_grazing"

    def triangles(self, rng):
        """Around the origin, so that f32 can say heights of 1e-6: half of them level, half of them tilted."""
        angle = rng.uniform(0, 2 * np.pi, (self.num_triangles, 1)) + np.arange(3) * 2 * np.pi / 3
        corners = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=2) * rng.uniform(
            0.5, 1, (self.num_triangles, 1, 1)
        )
        turn = np.linalg.qr(rng.normal(size=(self.num_triangles, 3, 3)))[0]
        corners[::2] = np.einsum("nij,nkj->nki", turn, corners)[::2]
        return corners

    def aim(self, rng, corners, target, n):
        """A target near 0, from 1 away, above the plane by the sine of the angle."""
        target = target * 10.0 ** rng.uniform(-3, 0, (len(n), 1))
        flat = unit_rows(np.cross(n, rng.normal(size=n.shape)))
        sine = 10.0 ** rng.uniform(-6, -1, (len(n), 1)) * rng.choice([-1, 1], (len(n), 1))
        origin = as_f32(target + flat + n * sine)
        return origin, (target - origin) * rng.uniform(0.5, 2, (len(n), 1))


class FarOrigins(DistanceCase):
    """Origins up to 1e6 from a triangle of size 10.

    What lies between the origin and the triangle is a difference of large numbers: where the triangle is seen from
    there, f32 says only to a sixteenth. Whether the inside is hit must not depend on it.
    """

    name, measure, stage = "t: origins at 1e4 to 1e6", "t_far", "soup"
    exponents = 4, 6

    def triangles(self, rng):
        """Corners lie around the origin."""
        return rng.normal(size=(self.num_triangles, 3, 3)) * 10


class InThePlane(Case):
    """Rays that lie in a triangle's plane, on it and beside it.

    The determinant is 0 and the barycentrics are 0/0. A test that asks "is u outside [0, 1]?" takes the NaN for inside;
    one that asks "is u inside?" does not.
    """

    name, stage, rays_wanted = "rays in the plane of a triangle", "unit", 0.1

    def mesh(self):
        """Small integers, so that the determinant is exactly 0 in f32, too."""
        corners = self.rng(2).integers(-3, 4, (40, 3, 3)).astype(float)
        area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).any(axis=1)
        return separate(corners[area] + [0, 0, 96])

    def rays(self, rng, count):
        """Origins and directions are whole multiples of the edges."""
        ids = rng.integers(0, len(self.faces), count)
        corners = self.vertices[self.faces[ids]]
        e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        a, b, p, q = rng.integers(-3, 4, (4, count, 1))
        directions = a * e1 + b * e2
        some = directions.any(axis=1)
        origins = corners[:, 0] + p * e1 + q * e2
        return CaseRays(origins[some], directions[some].astype(float), known={"ids": ids[some]})

    def judge(self, on, rays, epsilon):
        """No ray hits."""
        t = on.meet(rays, rays.known["ids"])
        hits = on.intersect(rays)
        return {"false_hits": int(np.isfinite(t).sum()), "nan": int(np.isnan(t).sum() + np.isnan(hits.distance).sum())}


# ── closed surfaces: no ray gets out, and none gets in unseen ──


FACING = 0.75  # cosine from which on all triangles around a point face an origin outside: no silhouette is near


class ClosedSphere(Case):
    """Rays aimed at edges and vertices of a closed surface, from inside and outside.

    Each triangle decides by its own rounded numbers on which side of an edge a ray passes. Where the two neighbours
    disagree, the ray passes between them: pinholes in pictures, light through walls. Far from the origin of the
    coordinates the numbers have fewer digits left, and the pinholes become many.
    """

    def __init__(self, name: str, stage: str, radius: float, centre, columns=16, rows=9) -> None:
        self.name, self.stage, self.radius = name, stage, radius
        self.centre, self.columns, self.rows = np.asarray(centre, np.float64), columns, rows

    def mesh(self):
        """The sphere; its edges and normals are kept for the aim."""
        vertices, faces = sphere(self.columns, self.rows, self.radius, self.centre)
        self.edges = edges_of(faces)
        self.normals = normals_of(vertices, faces)
        return vertices, faces

    def rays(self, rng, count):
        """A part from inside and a part from outside, each at points on edges and at vertices."""
        return joined([self.from_inside(rng, count - count // 4), self._from_outside(rng, count // 4)])

    def _targets(self, rng, count, vertices=True):
        edge = rng.integers(0, len(self.edges), count)
        share = rng.uniform(size=(count, 1))
        share[: count // 8] = 0.5
        is_vertex = (np.arange(count) >= count // 2) & vertices
        share[is_vertex] = 0
        p, q = self.vertices[self.edges[edge, 0]], self.vertices[self.edges[edge, 1]]
        return is_vertex, p * (1 - share) + q * share

    def from_inside(self, rng, count: int, vertices=True) -> CaseRays:
        """Rays at edges, and at ``vertices``, too: from two thirds of the way to the target, and a little aside."""
        is_vertex, target = self._targets(rng, count, vertices)
        aside = np.clip(rng.normal(size=(count, 3)), -2, 2) * 0.05 * self.radius
        origin = as_f32(self.centre + (target - self.centre) * rng.uniform(0.5, 0.8, (count, 1)) + aside)
        direction = as_f32(target - origin)
        none = np.zeros(count, bool)
        return CaseRays(origin, direction, known={"is_vertex": is_vertex, "is_outside": none})

    def _from_outside(self, rng, count):
        """As from inside, where all triangles around the target face the origin."""
        is_vertex, target = self._targets(rng, count)
        away = unit_rows(rng.normal(size=(count, 3)))
        away *= np.sign((away * (target - self.centre)).sum(axis=1, keepdims=True))
        origin = as_f32(target + away * self.radius * rng.uniform(0.25, 1.5, (count, 1)))
        direction = as_f32(target - origin)
        sure = (unit_rows(direction) * unit_rows(target - self.centre)).sum(axis=1) < -FACING
        known = {"is_vertex": is_vertex, "is_outside": np.ones(count, bool)}
        return CaseRays(origin, direction, known=known)[sure]

    def leaks(self, on: CaseInScene, rays: CaseRays, hits) -> np.ndarray:
        """From inside: no own triangle was met. From outside: none, or one on the far side."""
        ids = on.own(hits)
        into = (self.normals[np.maximum(ids, 0)] * rays.directions).sum(axis=1) > 0
        return (ids < 0) | (rays.known["is_outside"] & into)

    def judge(self, on, rays, epsilon):
        """No leak; normals face the origin, and the flag says of which side."""
        hits = on.intersect(rays)
        leaks, ids = self.leaks(on, rays, hits), on.own(hits)
        found = ids >= 0
        along = (self.normals[np.maximum(ids, 0)] * rays.directions).sum(axis=1)
        length = np.linalg.norm(rays.directions, axis=1)
        is_sure = found & (np.abs(along) > 1e-3 * length)
        wrong_side = is_sure & ((along > 0) != hits.is_backfacing)
        not_facing = is_sure & ((hits.geometric_normal * rays.directions).sum(axis=1) > 0)
        found &= np.isfinite(hits.distance)
        # Rays that start where others hit: x + 1e-6 n would be x itself in f32 from |x| ≥ 32 on.
        leaving = self.rng(2).normal(size=(found.sum(), 3))
        again = on.self_hits(ids[found], hits.barycentric_coords[found], leaving)
        return (
            leaks_in(leaks, rays)
            | again
            | {
                "false_hits": false_hits(on, rays, ids, epsilon),
                "wrong": int(wrong_side.sum() + not_facing.sum()),
                "nan": not_numbers(hits) + again["nan"],
            }
        )


def leaks_in(leaks: np.ndarray, rays: CaseRays) -> dict[str, int]:
    """How many of the rays at edges and of those at vertices leak."""
    is_vertex = rays.known["is_vertex"]
    return {
        "edge_leaks": int(leaks[~is_vertex].sum()),
        "edge_rays": int((~is_vertex).sum()),
        "vertex_leaks": int(leaks[is_vertex].sum()),
        "vertex_rays": int(is_vertex.sum()),
    }


class NestedSpheres(Case):
    """Closed spheres of radius 1e-6 … 1e6 within each other, all in one scene.

    An ε that suits one of them deletes, or thickens, the others: a fixed 1e-7 for the determinant removes every
    triangle of the small ones, and boxes padded for the large ones must still not hide the small ones.
    """

    name, stage = "sizes 1e-6 to 1e6 in one scene", "sizes"
    radii = tuple(10.0**k for k in range(-6, 7))

    def mesh(self):
        """A sphere of 64 triangles for every radius."""
        self.shells = [ClosedSphere(f"r={r:g}", self.stage, r, (0, 0, 0), 8, 5) for r in self.radii]
        meshes = [shell.build() for shell in self.shells]
        self.per_shell = len(meshes[0][1])
        return join(meshes)

    def rays(self, rng, count):
        """Rays from inside of each, outside of the next smaller one."""
        parts = [shell.from_inside(rng, count // len(self.shells)) for shell in self.shells]
        rays = joined(parts)
        rays.known["shell"] = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
        return rays

    def judge(self, on, rays, epsilon):
        """The sphere that was aimed at is hit: not the next, which is ten times as large."""
        hits = on.intersect(rays)
        ids = on.own(hits)
        return leaks_in(ids // self.per_shell != rays.known["shell"], rays) | {
            "false_hits": false_hits(on, rays, ids, epsilon),
            "nan": not_numbers(hits),
        }


class LeavingSurfaces(Case):
    """Rays that start on a surface, as every shadow ray and every reflection does.

    The computed point lies a little above or below the true surface. Started there, half of all rays hit the surface
    that they leave: black speckles all over the picture. A fixed step is too small for large coordinates and too large
    for small ones. pbrt's test: corners with coordinates of 10^U[−8, 8], rays into all directions.
    """

    name, stage = "leaving a surface, coordinates 1e-8 to 1e8", "soup"
    num_triangles = 1000

    def mesh(self):
        """Triangles of every size and shape; those without area in f32 are left out by the scene."""
        rng = self.rng(2)
        corners = 10.0 ** rng.uniform(-8, 8, (self.num_triangles, 3, 3)) * rng.choice(
            [-1, 1], (self.num_triangles, 3, 3)
        )
        return separate(corners)

    def rays(self, rng, count):
        """Directions over the sphere, a fifth of them close to the surface; the tracer finds where they start."""
        ids = rng.integers(0, len(self.faces), count)
        u = np.sqrt(rng.uniform(size=count))
        v = rng.uniform(size=count)
        barycentrics = as_f32(np.stack([u * (1 - v), u * v], axis=1))
        directions = unit_rows(rng.normal(size=(count, 3)))
        n = normals_of(self.vertices, self.faces)[ids]
        sine = 10.0 ** rng.uniform(-3, 0, (count, 1))
        flat = unit_rows(directions - n * (directions * n).sum(axis=1, keepdims=True))
        close = np.arange(count)[:, None] % 5 == 0
        directions = np.where(close, flat * np.sqrt(1 - sine**2) + n * sine, directions)
        points = self.vertices[self.faces[ids, 0]]
        return CaseRays(points, as_f32(directions), known={"ids": ids, "barycentrics": barycentrics})

    def judge(self, on, rays, epsilon):
        """No ray meets the triangle that it leaves."""
        return on.self_hits(rays.known["ids"], rays.known["barycentrics"], rays.directions)


# ── lattices, boxes, damaged and crowded meshes, windows of t, and rays that are none ──


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

    def with_truth(self, rays: CaseRays, candidates: slice = slice(None)) -> CaseRays:
        """The rays, and what they meet; ``candidates`` are the triangles that they may meet."""
        rays = rays[: self.most]
        ids, t = nearest_exactly(rays, self.vertices[self.faces[candidates]])
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


class Duplicates(Exact):
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
        return self.with_truth(CaseRays(origins, as_f32(target - origins)), slice(1))  # the first copy answers, always


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
