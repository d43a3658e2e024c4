"""Hard cases of objects that stand in several places: every size and shear, none at all, and a million of them."""

import itertools

import numpy as np

from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Instances, group
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.hard.case import LARGE, renderer_case, scene_without_warnings, sphere

TETRAHEDRON = np.array([(1.0, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
SIDES = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)], np.int32)  # fronts outside
RAYS = 2_000  # of each place


def places_at(linear: np.ndarray, where: np.ndarray) -> np.ndarray:
    """(n, 4, 4) transforms."""
    matrices = np.tile(np.eye(4), (len(where), 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = linear, where
    return matrices


def shared(ball: Mesh, linear: np.ndarray, where: np.ndarray) -> SceneData:
    """The scene of an object that stands in several places and is in memory once.

    Args:
        linear: (n, 3, 3), or one for all. where: (n, 3).
    """
    return scene_without_warnings(group([Instances(ball, places_at(linear, where))]), instances="shared")


@renderer_case("places: 1e-3 to 1e3 times as large, sheared, mirrored, 1e4 away")
def many_sizes(found, epsilon):
    """A closed sphere in places where it is a thousandth or a thousand times as large, sheared, mirrored, far away.

    A ray that is transformed into the object is rounded there. Where an object is small and far from the origin, the
    rounding is larger than its triangles: the ray passes between them, or by the boxes in which they lie. From the
    middle of each place, every corner and everything between must be hit, and normals have length 1.
    """
    shears = 0.0, 4.0
    vertices, faces = sphere(24, 13)
    rng = np.random.default_rng(4)
    turns, _ = np.linalg.qr(rng.normal(size=(2, 3, 3)))  # one of them mirrors, or both
    turns[1] *= -np.sign(np.linalg.det(turns[0])) * np.sign(np.linalg.det(turns[1]))
    ball = Mesh(vertices, faces)
    for scale in (1e-3, 1.0, 1e3):
        linear, where = [], []
        for shear, distance in itertools.product(shears, (0.0, 1e2, 1e4)):
            step = 9 * scale * (1 + max(shears)) * (len(where) - 6)
            linear += list(scale * turns @ np.array([(1, shear, 0), (0, 1, shear), (0, 0, 1)]))
            where += [(distance, -distance / 3, step), (-distance, 0, step + 9 * scale * (1 + shear))]
        scene = shared(ball, np.array(linear), np.array(where))
        for number, (matrix, place) in enumerate(zip(linear, where, strict=True)):
            hit_from_within(found, scene, number, matrix, np.float32(place).astype(float), ball, rng, epsilon)


def hit_from_within(found, scene, number, matrix, origin, ball, rng, epsilon) -> None:
    """Count the rays from the middle of a place that do not hit it."""
    if 1e3 * epsilon * np.abs(origin).max() >= np.linalg.svd(matrix)[1].min():
        return  # the middle may round to a point outside
    targets = ball.vertices[rng.integers(0, len(ball.vertices), RAYS)]
    targets[::2] = rng.normal(size=targets[::2].shape)
    hits = scene.intersect(np.tile(origin, (RAYS, 1)), targets @ matrix.T)
    lengths = np.linalg.norm(hits.normal.astype(np.float64), axis=1)
    is_own = hits.triangle_id // len(ball.faces) == number
    found.add(~is_own | (np.abs(lengths - 1) > 1e-5), int(np.isnan(hits.distance).sum()))


@renderer_case("places: scaled to 0, to 1e-30, into a plane")
def scaled_to_nothing(found, epsilon):
    """Places whose transform is 0, almost 0, or presses everything into a plane: they have no inverse.

    Its numbers are infinite or NaN, and a NaN in one box makes every box above it NaN: then the whole scene disappears.
    What has an area must be hit, also a plane; nothing else; the neighbours are there.
    """
    flat = np.diag([1.0, 1.0, 0.0])
    linear = np.array([np.zeros((3, 3)), 1e-30 * np.eye(3), flat, np.eye(3), np.diag([1e-20, 1, 1])])
    where = np.array([(10.0 * k, 0, 0) for k in range(len(linear))])
    scene = shared(Mesh(*sphere(24, 13)), linear, where)
    hits = scene.intersect(where + (0.1, 0.2, 5), np.tile((0.0, 0, -1), (len(where), 1)))
    expected = np.array([False, False, True, True, False])
    found.add(hits.is_hit != expected, int(np.isnan(hits.position).sum()))
    found.add(np.abs(hits.distance[2] - 5) > 1e-5)


@renderer_case("places: 19,683, each hit")
def some_places(found, epsilon, side=27):
    """Twenty thousand tetrahedra side by side, and a ray at each: which primitive of all is it, and where?

    A number of a primitive that is counted through all places is large, and a hierarchy over places is deep. The id
    must be that of the side of the tetrahedron, and the distance that from the origin of the ray.
    """
    gap = 4.0
    cells = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    where = gap * (cells - side // 2)
    scene = shared(Mesh(TETRAHEDRON, SIDES), np.eye(3), where)
    rng = np.random.default_rng(6)
    face, inner = rng.integers(0, 4, len(where)), rng.dirichlet((2, 2, 2), len(where))
    target = where + np.einsum("nk,nkj->nj", inner, TETRAHEDRON[SIDES[face]])
    outwards = TETRAHEDRON[SIDES[face]].sum(axis=1) / 3
    hits = scene.intersect(target + outwards, -outwards)
    off = np.abs(hits.distance - 1) > 64 * epsilon * gap * side
    found.add((hits.triangle_id != 4 * np.arange(len(where)) + face) | off, int(np.isnan(hits.distance).sum()))


@renderer_case("places: 1,000,000, each hit", LARGE)
def million_places(found, epsilon):
    """A million tetrahedra, and a ray at each: tables of places and their hierarchy are as large as those of a mesh."""
    some_places(found, epsilon, side=100)
