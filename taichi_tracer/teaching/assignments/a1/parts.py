"""What is checked in assignment 1: eye rays, the ray–triangle test, six views, and pictures."""

from types import SimpleNamespace

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.teaching import fixtures
from taichi_tracer.teaching.base import Arrays, Numbers, Part, method, picture
from taichi_tracer.teaching.fixtures import HIT, members, rows

RAYS, TRIANGLES, COLOURS = "eye rays", "ray–triangle intersection", "from hits to colours"

# ── eye rays ──


def pixels(rng: np.random.Generator) -> Arrays:
    """Every pixel of a picture."""
    size = fixtures.picture_size(rng)
    x, y = np.meshgrid(np.arange(size["width"]), np.arange(size["height"]))
    return {"pixel": np.stack([x.ravel(), y.ravel()], axis=1).astype(np.int32), **size}


@ti.func
def ndc(camera: ti.template(), pixel):
    """The point of a pixel."""
    return camera.generate_ndc_coords(pixel.x, pixel.y)


ANGLES, EACH = 8, 50


def points_and_angles(rng: np.random.Generator) -> Arrays:
    """Points of the image plane, 50 for each of eight angles."""
    fov = rng.permutation(np.linspace(20, 120, ANGLES) + rng.uniform(-3, 3, ANGLES))
    return {
        "ndc": rng.uniform(-1, 1, (ANGLES * EACH, 2)).astype(np.float32),
        "fov": np.repeat(fov, EACH).astype(np.float32),
        **fixtures.picture_size(rng),
    }


def run_camera_coords(camera_class: type, inputs: Arrays) -> Arrays:
    """The direction of each point, for the angle that belongs to it."""
    found = []
    for ndc, fov in zip(np.split(inputs["ndc"], ANGLES), inputs["fov"][::EACH], strict=True):
        camera = camera_class(int(inputs["width"]), int(inputs["height"]), fov=float(fov))
        found.append(rows(camera.generate_camera_coords, {"ndc": ndc}, ["ndc"], {"coords": 4})["coords"])
    return {"camera_coords": np.concatenate(found)}


def pixels_of_a_view(rng: np.random.Generator) -> Arrays:
    """Every pixel of a picture, for one camera."""
    view = {name: array[0] for name, array in fixtures.views(rng, 1).items()}
    return {**pixels(rng), **view}


# ── triangles ──


def triangles(rng: np.random.Generator, count: int) -> Arrays:
    """Triangles of ordinary shape around the origin, with vertex normals on the side that their winding faces."""
    corners = rng.uniform(-1, 1, (20 * count, 3, 3)) + rng.uniform(-1, 1, (20 * count, 1, 3))
    edges = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    corners = corners[area > 0.35 * np.square(edges).sum(axis=(1, 2)) / 12**0.5 / 2][:count]
    face_normal = fixtures.unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    normals = fixtures.unit(face_normal[:, None] + rng.uniform(-0.45, 0.45, (count, 3, 3)))
    return {
        "vertices": corners.reshape(-1, 3),
        "faces": np.arange(3 * count, dtype=np.int32).reshape(count, 3),
        "normals": normals.reshape(-1, 3),
        "material_ids": rng.integers(0, 5, count).astype(np.int32),
    }


MARGIN = 0.02  # how far u, v and w of a ray stay from an edge, so that rounding decides nothing


def rays_at_triangles(rng: np.random.Generator) -> Arrays:
    """Rays at one triangle each: through it, past each edge, behind the origin, at the back, and parallel to it.

    The directions have lengths between 0.3 and 3, and some have the length 1.
    """
    count = 30
    mesh = triangles(rng, count)
    corners = mesh["vertices"].reshape(count, 3, 3)
    rays = 400
    ids = rng.integers(0, count, rays)
    uv = rng.uniform(MARGIN, 1, (rays, 2))
    uv = np.where((uv.sum(axis=1) > 1)[:, None], 1 - uv + MARGIN / 2, uv)
    kind = np.arange(rays) % 8  # 0 to 3 hit; 4 to 6 pass beside u, v, w; 7 is behind the origin or parallel
    outside = rng.uniform(MARGIN, 0.8, rays)
    uv[kind == 4, 0], uv[kind == 5, 1] = -outside[kind == 4], -outside[kind == 5]
    beyond = uv[kind == 6]
    uv[kind == 6] = beyond / beyond.sum(axis=1, keepdims=True) * (1 + outside[kind == 6])[:, None]
    inside = kind < 4
    w = 1 - uv.sum(axis=1)
    uv[inside & (w < MARGIN)] = 1 / 3
    e1, e2 = corners[ids, 1] - corners[ids, 0], corners[ids, 2] - corners[ids, 0]
    target = corners[ids, 0] + uv[:, :1] * e1 + uv[:, 1:] * e2
    normal = fixtures.unit(np.cross(e1, e2))
    side = np.where(rng.random(rays) < 0.5, 1.0, -1.0)[:, None]
    away = fixtures.unit(normal * side + 0.8 * fixtures.directions(rng, rays))
    steep = abs((away * normal).sum(axis=1)) > 0.15
    away = np.where(steep[:, None], away, normal * side)
    length = np.where(rng.random((rays, 1)) < 0.3, 1, np.exp(rng.uniform(np.log(0.3), np.log(3), (rays, 1))))
    origin, direction = target + away * rng.uniform(0.5, 4, (rays, 1)), -away * length
    behind = (kind == 7) & (rng.random(rays) < 0.7)
    direction[behind] *= -1
    parallel = (kind == 7) & ~behind
    direction[parallel] = (fixtures.unit(e1) * length)[parallel]
    return {
        "origin": origin.astype(np.float32),
        "direction": direction.astype(np.float32),
        "triangle_id": ids.astype(np.int32),
        **mesh,
    }


@ti.func
def hit_on_triangle(intersector: ti.template(), origin, direction, triangle_id):
    """The hit of a ray on its own triangle."""
    return members(intersector.intersect_triangle(tt.Ray(origin=origin, direction=direction), triangle_id))


def rays_at_many(rng: np.random.Generator) -> Arrays:
    """Rays at 24 triangles that lie one behind the other; one ray of eight hits nothing."""
    mesh = triangles(rng, 24)
    rays = 200
    origin = 5 * fixtures.directions(rng, rays)
    inner = rng.uniform(-0.8, 0.8, (rays, 3))
    inner[::3] *= 0.2
    direction = (inner - origin) * rng.uniform(0.2, 1, (rays, 1))
    direction[::8] *= -1
    keep = is_clear(mesh, origin, direction)
    return {"origin": origin[keep].astype(np.float32), "direction": direction[keep].astype(np.float32), **mesh}


def is_clear(mesh: Arrays, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(n,) bool: whether rounding cannot decide what each ray hits: no edge, and no second hit, is close to a hit."""
    t, u, v = fixtures.met_planes(origin[:, None], direction[:, None], mesh["vertices"].reshape(-1, 3, 3))
    w = 1 - u - v
    near_edge = (np.minimum(np.minimum(abs(u), abs(v)), abs(w)) < 0.005).any(axis=1)
    hits = np.sort(np.where((u >= 0) & (v >= 0) & (w >= 0) & (t > 0), t, np.inf), axis=1)
    with np.errstate(invalid="ignore"):
        near_second = hits[:, 1] - hits[:, 0] < 0.01
    return ~near_edge & ~near_second


@ti.func
def nearest_hit(intersector: ti.template(), origin, direction):
    """The nearest hit of a ray."""
    return members(intersector.query_ray(tt.Ray(origin=origin, direction=direction)))


# ── views ──


def hits(rng: np.random.Generator) -> Arrays:
    """90 hits of every kind, and 10 misses."""
    count = 100
    uv = rng.dirichlet([1, 1, 1], count)[:, :2]
    ids = rng.integers(0, [[2, 500, 40]], (count, 3))
    whole = np.concatenate([np.ones((count, 1)), ids], axis=1).astype(np.int32)
    whole[::10] = [0, 0, -1, -1]
    distance = rng.uniform(0, 14, (count, 1))
    real = np.concatenate([distance, uv, fixtures.directions(rng, count)], axis=1).astype(np.float32)
    real[::10] = [np.inf, 0, 0, 0, 0, 0]
    return dict(zip(HIT, [*whole.T.copy(), real[:, 0], real[:, 1:3], real[:, 3:]], strict=True))


@ti.func
def color(shade: ti.template(), is_hit, is_backfacing, triangle_id, material_id, distance, barycentric_coords, normal):
    """The colour of a hit, by one of the views."""
    hit = tt.no_hit()
    hit.is_hit, hit.is_backfacing, hit.triangle_id = is_hit, is_backfacing, triangle_id
    hit.material_id, hit.distance, hit.barycentric_coords = material_id, distance, barycentric_coords
    hit.normal = hit.geometric_normal = normal
    return shade(hit)


# ── pictures ──

SIZE = 48  # pixels on a side


def run_picture(view: str):
    """A function that renders one view of the Cornell box with all of the student's classes."""

    def run(classes, inputs: Arrays) -> Arrays:
        scene = tt.load_scene_data("cornell_box", intersector=classes.RayIntersector)
        camera = classes.Camera(SIZE, SIZE, **fixtures.view_of(inputs))
        picture = np.asarray(classes.A1Renderer(scene, camera=camera, jitter=False).use(view).image())
        scene.destroy()
        return {"picture": picture}

    return run


def view_part(name: str) -> Part:
    """The part of one view."""

    def shade(renderer_class: type, _inputs: Arrays):
        """The method of the view."""
        integrators = {"distance": SimpleNamespace(max_distance=10.0)}
        return getattr(fixtures.bare(renderer_class, _integrators=integrators), f"shade_{name}")

    run_view = fixtures.on_rows(color, list(HIT), {"color": 3}, shade)
    return method(f"A1Renderer.shade_{name}", 0.5, COLOURS, hits, run_view, Numbers(1e-4, called="hits"))


PIXELS, HITS = Numbers(1e-4, called="pixels"), Numbers(2e-3, "is_hit", "rays")
POINTS, CAMERAS = Numbers(1e-4, called="points"), Numbers(1e-4, called="cameras")
RUN_NDC = fixtures.on_rows(ndc, ["pixel"], {"ndc": 2}, fixtures.camera_of)
RUN_NEAREST = fixtures.on_rows(nearest_hit, ["origin", "direction"], HIT, fixtures.intersector)
RUN_TRIANGLE = fixtures.on_rows(hit_on_triangle, ["origin", "direction", "triangle_id"], HIT, fixtures.intersector)
PARTS = (
    method("Camera.generate_ndc_coords", 2, RAYS, pixels, RUN_NDC, PIXELS),
    method("Camera.generate_camera_coords", 3, RAYS, points_and_angles, run_camera_coords, POINTS),
    method("Camera.compute_matrix", 3, RAYS, fixtures.places, fixtures.run_matrix, CAMERAS),
    method("Camera.generate_ray", 2, RAYS, pixels_of_a_view, fixtures.RUN_EYE_RAYS, PIXELS),
    method("RayIntersector.intersect_triangle", 7, TRIANGLES, rays_at_triangles, RUN_TRIANGLE, HITS),
    method("RayIntersector.query_ray", 3, TRIANGLES, rays_at_many, RUN_NEAREST, HITS),
    *(view_part(name) for name in ("hit", "triangle_id", "distance", "barycentric", "normal", "material_id")),
    *(picture(view, 1, fixtures.front_view, run_picture(view)) for view in ("distance", "normal", "barycentric")),
)
