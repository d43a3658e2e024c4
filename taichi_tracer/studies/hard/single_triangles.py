"""Single triangles: how exact t is, and rays in the triangle's own plane."""

import numpy as np

from taichi_tracer.studies.hard import oracle
from taichi_tracer.studies.hard.case import Case, CaseRays, as_f32, separate, unit_rows

SURELY_INSIDE = 0.05  # barycentric coordinates above it leave no doubt that the ray hits
MOST_EXACT = 400  # rays whose t is computed in integers, which takes 0.1 ms each


def steep(rng, n) -> np.ndarray:
    """Random directions at more than 17 degrees to the planes with the unit normals ``n``."""
    away = unit_rows(rng.normal(size=n.shape))
    return np.where(np.abs((away * n).sum(axis=1, keepdims=True)) < 0.3, n, away)


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
        origin = as_f32(target + steep(rng, n) * 10.0 ** rng.uniform(*self.exponents, (len(n), 1)))
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
        origins, directions, ids = origins[inside], directions[inside], ids[inside]
        position, t = oracle.exact_hit(origins, directions, corners[inside])
        ahead = (position == 1) & (t > 0)
        return CaseRays(origins[ahead], directions[ahead], known={"ids": ids[ahead], "t": t[ahead]})

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
