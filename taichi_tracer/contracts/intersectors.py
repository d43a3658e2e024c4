"""What every intersector must do: answer as brute force does, to the last bit.

The truth is ``brute_force`` with the same triangle test.
"""

from functools import lru_cache

import numpy as np

import taichi_tracer as tt
from taichi_tracer.contracts.lab import lattice, separate, soup, sphere
from taichi_tracer.formulas.view import box_of
from taichi_tracer.geometry import Mesh
from taichi_tracer.system.parts import PARTS

TRUTH = tt.BruteForceRayIntersector
RAYS = 40_000
OWN_RAYS = 4_000
ROUNDING = 1e-4  # of t, for tests of triangles that round in another way
FIELDS = ("triangle_id", "distance", "barycentric_coords", "normal", "geometric_normal", "material_id", "is_backfacing")


# ── what rays meet ──


def several_shapes(rng):
    """A closed sphere, a flat and a deep soup, and triangles with corners on a lattice, side by side."""
    flat, _ = soup(rng, 60)
    flat[:, 1] = 0.25
    return together([sphere()[0][sphere()[1]].reshape(-1, 3), soup(rng, 100)[0], flat, lattice(rng, 60)[0]])


def a_sphere_and_a_soup(rng):
    """No two triangles of which lie in one plane, so that each ray has one nearest triangle."""
    vertices, faces = sphere(centre=(0.013, 0.021, 0.034))  # no edge lies along an axis through a corner of another
    return together([vertices[faces].reshape(-1, 3), soup(rng, 200)[0]])


def far_away(rng):
    """A sphere whose coordinates have few digits left."""
    return Mesh(*sphere(centre=(14837.5, 123.4, -22342.3)))


def all_sizes(rng):
    """Triangles of sizes from 1e-6 to 1e6."""
    return together([soup(rng, 40, size=10.0**k)[0] for k in (-6, -3, 0, 3, 6)])


def all_primitives(rng):
    """Triangles with vertex normals and without, of one side and of two, among spheres: diffuse, glossy, mirrors."""
    vertices, faces = soup(rng, 60)
    radius = rng.uniform(0.05, 0.6, (20, 1))
    return Mesh(
        vertices,
        faces,
        normals=rng.normal(size=(len(vertices), 3)),
        face_normals=np.where(np.arange(60)[:, None] % 3 == 0, -1, faces),
        face_materials=(np.arange(60) % 3).astype(np.int32),
        materials=[tt.Material(f"Ns {ns:g}", Kd=(0.7, 0.6, 0.5), Ns=ns) for ns in (1.0, 50.0, 1e21)],
        spheres=np.hstack([rng.uniform(-1, 1, (20, 3)), radius]),
        sphere_ids=np.arange(1, 80, 4).astype(np.int32),
        sphere_materials=(np.arange(20) % 3).astype(np.int32),
        face_culls=np.arange(60) % 4 == 0,
    )


def together(parts):
    """A mesh of (n, 3) corners of triangles, those of each part one after the other."""
    return Mesh(*separate(np.concatenate(parts)))


def rays_of_all_kinds(rng, mesh, count):
    """Random, axis-parallel, grazing, aimed at vertices and edges, on the surface, and degenerate rays."""
    vertices, faces = mesh.vertices, mesh.faces
    low, high = box_of(vertices)
    size = np.maximum(high - low, 1e-3 * np.abs(vertices).max() + 1e-9)
    origins = rng.uniform(low - size, high + size, (count, 3))
    directions = rng.normal(size=(count, 3))
    part = np.array_split(np.arange(count), 10)
    corners = vertices[faces[rng.integers(0, len(faces), count)]]
    directions[part[0]] = corners[part[0], 0] - origins[part[0]]
    directions[part[1]] = (corners[part[1], 0] + corners[part[1], 1]) / 2 - origins[part[1]]
    directions[part[2]] *= [0, 0, 1]
    directions[part[3]] *= [1, -0.0, 1]
    origins[part[4]] = corners[part[4]].mean(axis=1)
    edge = corners[part[5], 1] - corners[part[5], 0]
    origins[part[5]] = corners[part[5], 0] - edge
    directions[part[5]] = edge * (1 + 1e-6 * rng.normal(size=edge.shape))
    origins[part[6]] = corners[part[6], 2] - [0, 0, 3]
    directions[part[6]] = [0, 0, 1]
    directions[part[7]] *= 10.0 ** rng.uniform(-10, 10, (len(part[7]), 1))
    strange = [[0, 0, 0], [np.nan] * 3, [np.inf, 0, 1], [1, 1e-42, -1e-42], [0, 1, 1]]
    directions[part[8]] = np.resize(strange, (len(part[8]), 3))
    origins[part[8][4::5]] = np.inf
    return origins, directions


@lru_cache
def mesh_and_rays(shape, count):
    """(mesh in f32 coordinates, origins, directions) of one of the shapes, the same every time."""
    rng = np.random.default_rng(20)
    mesh = shape(rng)
    mesh.vertices = mesh.vertices.astype(np.float32).astype(np.float64)
    return mesh, *rays_of_all_kinds(rng, mesh, count)


def answers(part, mesh, test, origins, directions, nearest=None):
    """Name → (hits, whether anything is in the way): of all rays, of those of an interval, and of those that begin or
    end exactly where the nearest hit is, at the distances ``nearest``."""
    scene, some = tt.SceneData(mesh, intersector=part, triangle_test=test), slice(None, None, 8)
    found = {"all": (scene.intersect(origins, directions), scene.occluded(origins, directions))}
    nearest = found["all"][0].distance[some] if nearest is None else nearest
    intervals = {
        "0.5 < t < 1.5": {"t_min": 0.5, "t_max": 1.5},
        "before the nearest hit": {"t_max": nearest},
        "after the nearest hit": {"t_min": np.where(np.isfinite(nearest), nearest, 0)},
    }
    for name, interval in intervals.items():
        asked = origins[some], directions[some]
        found[name] = scene.intersect(*asked, **interval), scene.occluded(*asked, **interval)
    scene.destroy()
    return found


@lru_cache
def truth(shape, count, test):
    """The answers of brute force for one of the shapes."""
    mesh, *rays = mesh_and_rays(shape, count)
    return answers(TRUTH, mesh, test, *rays)


# ── the checks ──


def check_intersector(part):
    """The answers of brute force, to the last bit, on triangles and spheres of all sizes; nothing in an empty scene."""
    for test in PARTS.names("triangle test"):
        check_equals_brute_force(part, several_shapes, test)
    for shape in (all_primitives, far_away, all_sizes):
        check_equals_brute_force(part, shape)
    check_nothing_to_hit(part)


def check_equals_brute_force(part, shape, test="watertight", count=None):
    """The same answers for one of the shapes.

    These are hit, t, barycentrics, normals, ids and sides to the last bit, and whether anything is in the way.
    """
    mesh, *rays = mesh_and_rays(shape, count or RAYS)
    expected = truth(shape, count or RAYS, test)
    found = answers(part, mesh, test, *rays, expected["all"][0].distance[::8])
    for asked, (hits, _) in expected.items():
        what = f"{part.name}, {test}, {shape.__name__}, {asked}"
        check_hits(what, rays, hits, found[asked][0])
        assert (found[asked][1] == hits.is_hit).all(), f"{what}: occluded and intersect do not agree"


def check_hits(what, rays, expected, found, is_compared=True, limits=None):
    """The members of two ``RayHits`` are the same.

    Args:
        rays: origins and directions; of those that were asked for the hits, which may be every eighth.
        is_compared: (N,) bool, which of the hits are compared. limits: member → how much it may differ, if not 0.
    """
    for field in FIELDS:
        a, b = getattr(expected, field), getattr(found, field)
        with np.errstate(invalid="ignore"):  # of misses, which are at infinity
            differs = (a != b) & ~(np.abs(np.subtract(a, b, dtype=float)) <= (limits or {}).get(field, 0))
        wrong = np.flatnonzero(differs.reshape(len(a), -1).any(axis=1) & is_compared)
        first = wrong[:1] * (len(rays[0]) // len(a))
        assert len(wrong) == 0, (
            f"{what}: {field} is {b[wrong[0]]}, not {a[wrong[0]]}, and {len(wrong)} of {len(a)} rays differ from "
            f"brute force; the first is {[v[first].tolist() for v in rays]}"
        )


def check_nothing_to_hit(part):
    """No triangles, or none that a ray could meet."""
    for vertices, faces in (
        (np.zeros((0, 3)), np.zeros((0, 3), int)),
        ([[np.nan, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
    ):
        scene = tt.scene_from_mesh(vertices, faces, intersector=part)
        hits = scene.intersect([[0, 0, 1.0]], [[0, 0, -1.0]])
        assert not hits.is_hit[0], f"{part.name}: hits something in an empty scene"
        missed = hits.triangle_id[0], hits.distance[0]
        assert missed == (-1, np.inf), f"{part.name}: the id and the distance of a miss are {missed}"


def is_clear(hits):
    """(N,) bool: hits beside which no edge is near, and which are not near the origin; and misses."""
    u, v = hits.barycentric_coords.T
    edge = np.minimum(np.minimum(np.abs(u), np.abs(v)), np.abs(1 - u - v))
    return ~hits.is_hit | ((edge > 1e-3) & (np.abs(hits.distance) > 1e-3))


def check_equals_the_packages(part, count=OWN_RAYS):
    """The same triangles as brute force, and t, normals and sides up to rounding, where no edge is near.

    For an intersector that has a test of triangles of its own: such a test rounds as it likes.
    """
    mesh, origins, directions = mesh_and_rays(a_sphere_and_a_soup, count)
    length = np.linalg.norm(directions, axis=1)
    usual = np.isfinite(origins).all(axis=1) & (np.abs(np.log10(length + 1e-30)) < 3)
    rays = origins[usual], directions[usual]
    right = tt.SceneData(mesh, intersector=TRUTH).intersect(*rays)
    scene = tt.SceneData(mesh, intersector=part)
    found, blocked = scene.intersect(*rays), scene.occluded(*rays)
    cosine = np.abs((right.geometric_normal * rays[1]).sum(axis=1)) / length[usual]
    clear = is_clear(right) & is_clear(found) & ((cosine > 0.1) | ~right.is_hit)
    limits = {"distance": ROUNDING * right.distance, "barycentric_coords": 100 * ROUNDING, "normal": 100 * ROUNDING}
    check_hits(part.name, rays, right, found, clear, limits | {"geometric_normal": np.inf})
    assert (blocked == found.is_hit)[clear].all(), f"{part.name}: occluded and intersect do not agree"
    scene.destroy()
