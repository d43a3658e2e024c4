"""Hard cases of objects that stand in several places: every size and shear, none at all, and a million of them."""

import warnings
from dataclasses import asdict

import numpy as np

from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Instances, group
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.hard.case import CaseTally, RendererCase
from taichi_tracer.studies.hard.meshes import sphere

TETRAHEDRON = np.array([(1.0, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
SIDES = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)], np.int32)  # fronts outside


def places_at(linear: np.ndarray, where: np.ndarray) -> np.ndarray:
    """(n, 4, 4) transforms."""
    matrices = np.tile(np.eye(4), (len(where), 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = linear, where
    return matrices


def shared(mesh: Mesh) -> SceneData:
    """The scene of a group whose objects are in memory once."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what is dropped is what is tried
        return SceneData(mesh, instances="shared")


class ManySizes(RendererCase):
    """A closed sphere in places where it is a thousandth or a thousand times as large, sheared, mirrored, far away.

    A ray that is transformed into the object is rounded there. Where an object is small and far from the origin, the
    rounding is larger than its triangles: the ray passes between them, or by the boxes in which they lie.
    """

    name = "places: 1e-3 to 1e3 times as large, sheared, mirrored, 1e4 away"
    scales, shears, distances = (1e-3, 1.0, 1e3), (0.0, 4.0), (0.0, 1e2, 1e4)
    rays = 2_000  # of each place

    def judge(self, epsilon):
        """From the middle of each place, every corner and everything between is hit, and normals have length 1."""
        vertices, faces = sphere(24, 13)
        vertices = vertices.astype(np.float32).astype(np.float64)
        rng, found = np.random.default_rng(4), CaseTally()
        turns, _ = np.linalg.qr(rng.normal(size=(2, 3, 3)))  # one of them mirrors, or both
        turns[1] *= -np.sign(np.linalg.det(turns[0])) * np.sign(np.linalg.det(turns[1]))
        ball = Mesh(vertices, faces)
        for scale in self.scales:
            linear, where = [], []
            for shear in self.shears:
                for distance in self.distances:
                    step = 9 * scale * (1 + max(self.shears)) * (len(where) - 6)
                    linear += list(scale * turns @ np.array([(1, shear, 0), (0, 1, shear), (0, 0, 1)]))
                    where += [(distance, -distance / 3, step), (-distance, 0, step + 9 * scale * (1 + shear))]
            matrices = places_at(np.array(linear), np.array(where))
            scene = shared(group([Instances(ball, matrices)]))
            for number, matrix in enumerate(matrices):
                self._from_within(scene, number, matrix, ball, rng, found, epsilon)
            scene.destroy()
        return asdict(found)

    def _from_within(self, scene, number, matrix, ball, rng, found, epsilon) -> None:
        targets = ball.vertices[rng.integers(0, len(ball.vertices), self.rays)]
        targets[::2] = rng.normal(size=targets[::2].shape)
        origin = matrix[:3, 3].astype(np.float32).astype(np.float64)
        resolved = 1e3 * epsilon * np.abs(origin).max() < np.linalg.svd(matrix[:3, :3])[1].min()
        if not resolved:  # the middle may round to a point outside
            return
        hits = scene.intersect(np.tile(origin, (self.rays, 1)), targets @ matrix[:3, :3].T)
        lengths = np.linalg.norm(hits.normal.astype(np.float64), axis=1)
        is_own = hits.triangle_id // len(ball.faces) == number
        found.add(~is_own | (np.abs(lengths - 1) > 1e-5), int(np.isnan(hits.distance).sum()))


class ScaledToNothing(RendererCase):
    """Places whose transform is 0, almost 0, or presses everything into a plane: they have no inverse.

    Its numbers are infinite or NaN, and a NaN in one box makes every box above it NaN: then the whole scene disappears.
    """

    name = "places: scaled to 0, to 1e-30, into a plane"

    def judge(self, epsilon):
        """What has an area is hit, also a plane; nothing else is; the neighbours are there."""
        flat = np.diag([1.0, 1.0, 0.0])
        linear = np.array([np.zeros((3, 3)), 1e-30 * np.eye(3), flat, np.eye(3), np.diag([1e-20, 1, 1])])
        where = np.array([(10.0 * k, 0, 0) for k in range(len(linear))])
        ball = Mesh(*sphere(24, 13))
        scene = shared(group([Instances(ball, places_at(linear, where))]))
        hits = scene.intersect(where + (0.1, 0.2, 5), np.tile((0.0, 0, -1), (len(where), 1)))
        found = CaseTally()
        expected = np.array([False, False, True, True, False])
        found.add(hits.is_hit != expected, int(np.isnan(hits.position).sum()))
        found.add(np.abs(hits.distance[2] - 5) > 1e-5)
        scene.destroy()
        return asdict(found)


class SomePlaces(RendererCase):
    """Twenty thousand tetrahedra side by side, and a ray at each: which primitive of all is it, and where?

    A number of a primitive that is counted through all places is large, and a hierarchy over places is deep.
    """

    side, name = 27, "places: 19,683, each hit"
    gap = 4.0

    def judge(self, epsilon):
        """The id is that of the side of the tetrahedron, and the distance is that from the origin of the ray."""
        cells = np.stack(np.meshgrid(*[np.arange(self.side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        where = self.gap * (cells - self.side // 2)
        scene = shared(group([Instances(Mesh(TETRAHEDRON, SIDES), places_at(np.eye(3)[None], where))]))
        found, rng = CaseTally(), np.random.default_rng(6)
        for first in range(0, len(where), 1 << 17):
            numbers = np.arange(first, min(first + (1 << 17), len(where)))
            side = rng.integers(0, 4, len(numbers))
            inner = rng.dirichlet((2, 2, 2), len(numbers))
            target = where[numbers] + np.einsum("nk,nkj->nj", inner, TETRAHEDRON[SIDES[side]])
            outwards = TETRAHEDRON[SIDES[side]].sum(axis=1) / 3
            hits = scene.intersect(target + outwards, -outwards)
            off = np.abs(hits.distance - 1) > 64 * epsilon * self.gap * self.side
            found.add((hits.triangle_id != 4 * numbers + side) | off, int(np.isnan(hits.distance).sum()))
        scene.destroy()
        return asdict(found)


class MillionPlaces(SomePlaces):
    """A million tetrahedra, and a ray at each: tables of places and their hierarchy are as large as those of a mesh."""

    side, name = 100, "places: 1,000,000, each hit"


INSTANCES = (ManySizes, ScaledToNothing, SomePlaces)
LARGE = (MillionPlaces,)
