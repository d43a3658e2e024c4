"""Closed surfaces: no ray gets out, and none gets in unseen."""

import numpy as np

from taichi_tracer.studies.hard.case import (
    Case,
    CaseInScene,
    CaseRays,
    as_f32,
    edges_of,
    false_hits,
    join,
    joined,
    normals_of,
    not_numbers,
    separate,
    sphere,
    unit_rows,
)

FACING = 0.75  # cosine from which on all triangles around a point face an origin outside: no silhouette is near


class ClosedSphere(Case):
    """Rays aimed at edges and vertices of a closed surface, from inside and outside.

    Each triangle decides by its own rounded numbers on which side of an edge a ray passes. Where the two neighbours
    disagree, the ray passes between them: pinholes in pictures, light through walls. Far from the origin of the
    coordinates the numbers have fewer digits left, and the pinholes become many.
    """

    def __init__(self, name: str, stage: str, radius: float, centre, columns=16, rows=9, outside=True) -> None:
        self.name, self.stage, self.radius, self.outside = name, stage, radius, outside
        self.centre, self.columns, self.rows = np.asarray(centre, np.float64), columns, rows

    def mesh(self):
        """The sphere; its edges and normals are kept for the aim."""
        vertices, faces = sphere(self.columns, self.rows, self.radius, self.centre)
        self.edges = edges_of(faces)
        self.normals = normals_of(vertices, faces)
        return vertices, faces

    def rays(self, rng, count):
        """A part from inside and a part from outside, each at points on edges and at vertices."""
        inside = self._from_inside(rng, count if not self.outside else count - count // 4)
        if not self.outside:
            return inside
        return joined([inside, self._from_outside(rng, count // 4)])

    def edge_rays(self, rng, count: int) -> CaseRays:
        """Rays from inside, all at edges: for long runs."""
        return self._from_inside(rng, count, vertices=False)

    def _targets(self, rng, count, vertices=True):
        edge = rng.integers(0, len(self.edges), count)
        share = rng.uniform(size=(count, 1))
        share[: count // 8] = 0.5
        is_vertex = np.zeros(count, bool)
        if vertices:
            is_vertex[count // 2 :] = True
            share[is_vertex] = 0
        p, q = self.vertices[self.edges[edge, 0]], self.vertices[self.edges[edge, 1]]
        return is_vertex, p * (1 - share) + q * share

    def _from_inside(self, rng, count, vertices=True):
        """The origin lies between the centre and the target: two thirds of the way, and a little aside."""
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
        far_side = rays.known["is_outside"] & (ids >= 0)
        into = (self.normals[np.maximum(ids, 0)] * rays.directions).sum(axis=1) > 0
        return (ids < 0) | (far_side & into)

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
        findings = leaks_in(leaks, rays) | {
            "false_hits": false_hits(on, rays, ids, epsilon),
            "wrong": int(wrong_side.sum() + not_facing.sum()),
            "nan": not_numbers(hits),
        }
        found &= hits.is_hit & np.isfinite(hits.distance)
        return findings | self._self_hits(on, ids[found], hits.barycentric_coords[found])

    def _self_hits(self, on, ids, barycentrics):
        """Rays that start where others hit: x + 1e-6 n would be x itself in f32 from |x| ≥ 32 on."""
        directions = self.rng(2).normal(size=(len(ids), 3))
        origins = on.leave(ids, barycentrics, directions)
        again = on.meet(CaseRays(origins, directions), ids)
        return {"self_hits": int(np.isfinite(again).sum()), "self_hit_rays": len(ids)}


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
        self.shells = [ClosedSphere(f"r={r:g}", self.stage, r, (0, 0, 0), 8, 5, outside=False) for r in self.radii]
        meshes = [shell.build() for shell in self.shells]
        self.per_shell = len(meshes[0][1])
        return join(meshes)

    def rays(self, rng, count):
        """Rays from inside of each, outside of the next smaller one."""
        parts = [shell.rays(rng, count // len(self.shells)) for shell in self.shells]
        shell = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
        rays = joined(parts)
        rays.known["shell"] = shell
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
        ids = rays.known["ids"]
        origins = on.leave(ids, rays.known["barycentrics"], rays.directions)
        again = on.meet(CaseRays(origins, rays.directions), ids)
        no_origin = ~np.isfinite(origins).all(axis=1)
        return {"self_hits": int(np.isfinite(again).sum()), "self_hit_rays": len(ids), "nan": int(no_origin.sum())}
