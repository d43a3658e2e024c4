"""What the parts of assignments are run with: cameras, geometries and hits without a scene, so that little is compiled.

A part gives a student's method, or a ``ti.func`` of its own that calls this method, to ``rows``. If the answers are
random, it gives it to ``samples``, which calls it many times for each row. So no part needs a kernel of its own.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.contracts.lab import WHOLE, Rows, bound
from taichi_tracer.course.files import bare as bare
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.geometry import Geometry, Mesh
from taichi_tracer.samplers.independent import IndependentSampler
from taichi_tracer.system import runtime
from taichi_tracer.system.compile_time import inside_kernel
from taichi_tracer.teaching.base import Arrays, statistics

# ── functions of kernels, called for rows ──


SEED = 5  # of the random numbers of all parts; the inputs of a part have a seed of their own
RANDOM = IndependentSampler()


@ti.func
def begin(row, call):
    """Begin the random numbers of one call."""
    RANDOM.start(ti.u32(SEED), row, 0, call)


def rows(
    function: Callable, inputs: Arrays, names: Sequence[str], answers: Mapping[str, int], numbers: range = range(0)
) -> Arrays:
    """What a function of kernels returns for every row of some inputs.

    Args:
        function: a ``ti.func``, or a method that is one. It returns one value, or a tuple with one for each answer.
        inputs, names: the names of the arrays of ``inputs`` whose rows are its arguments, in this order. A row of an
            (n,) array is a number, and one of an (n, k) array is a vector. Real numbers are rounded to f32.
        answers: name → how many numbers the answer has: 1 or more real ones, or ``WHOLE``.
        numbers: the numbers of the rows, for a function without arguments.

    Returns:
        Name → (n,) or (n, width) array.
    """
    found = samples(function, inputs, names, answers, 1, numbers, None)
    return {name: np.ascontiguousarray(array[:, 0]) for name, array in found.items()}


def samples(
    function: Callable,
    inputs: Arrays,
    names: Sequence[str],
    answers: Mapping[str, int],
    count: int,
    numbers: range = range(0),
    begins: Callable | None = begin,
) -> Arrays:
    """What a function that draws random numbers returns, ``count`` times for every row; see ``rows``.

    Args:
        numbers: the numbers of the rows, for a function without arguments. Rows with different numbers have different
            random numbers.
        begins: is called before each call.

    Returns:
        Name → (n, count) or (n, count, width) array.
    """
    given = [inputs[name] for name in names]
    widths = [(1 if a.dtype.kind == "f" else -1) * (a.shape[1] if a.ndim > 1 else 1) for a in given]
    found = Rows(function, widths, list(answers.values()), begins).calls(given, count, numbers)
    kinds = [np.int32 if width == WHOLE else np.float32 for width in answers.values()]
    return {name: array.astype(kind) for name, array, kind in zip(answers, found, kinds, strict=True)}


# ── cameras, geometries, hits ──


_KEPT: dict[str, tuple[tuple, Any]] = {}


def cached(name: str, make: Callable[..., Any], *arrays: np.ndarray) -> Any:
    """``make(*arrays)``; the last result of each name is kept, because making fields takes longer than using them.

    The program of Taichi belongs to the key: fields end with it.
    """
    runtime.ensure()
    key = (ti.lang.impl.get_runtime().prog, *(np.ascontiguousarray(array).tobytes() for array in arrays))
    if name not in _KEPT or _KEPT[name][0] != key:
        _KEPT[name] = key, make(*arrays)
    return _KEPT[name][1]


def geometry(inputs: Arrays) -> Geometry:
    """The triangles in "vertices", "faces", "normals" and "material_ids" of the inputs."""
    names = ("vertices", "faces", "normals", "material_ids")
    return cached("triangles", make_triangles, *(inputs[name] for name in names)).geometry


def make_triangles(vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray, material_ids: np.ndarray) -> Any:
    """A scene of triangles with a normal for each vertex at their corners; normals have other ids than vertices."""
    faces = np.asarray(faces, np.int32)
    mesh = Mesh(
        np.asarray(vertices, np.float64),
        faces,
        normals=np.asarray(normals, np.float64)[::-1],
        face_normals=np.int32(len(normals) - 1) - faces,
        face_materials=np.asarray(material_ids, np.int32),
        materials=[tt.Material(f"m{i}") for i in range(np.max(material_ids) + 1)],
    )
    return tt.SceneData(mesh, intersector=tt.BruteForceRayIntersector)


def intersector(cls: type, inputs: Arrays) -> Any:
    """An intersector of the class under test, for the triangles of the inputs."""
    return cls(geometry(inputs))


def on_rows(
    ask: str | Callable,
    names: Sequence[str],
    answers: Mapping[str, int],
    make: Callable[[type, Arrays], Any] = lambda cls, _inputs: bare(cls),
) -> Callable[[type, Arrays], Arrays]:
    """A function that asks an object of the class under test on every row of some inputs; see ``rows``.

    Args:
        ask: the name of a method, or a ``ti.func`` of the object and the arguments in the rows.
        make: (the class, inputs) → the object; without it, the method needs no attributes.
    """

    def run(cls: type, inputs: Arrays) -> Arrays:
        made = make(cls, inputs)
        function = getattr(made, ask) if isinstance(ask, str) else bound(ask, made)
        return rows(function, inputs, names, answers)

    return run


OUTSIDE = -1000.0  # what a read beyond the ends of a table gives


class Guarded:
    """A field [i, j] that can be read anywhere: beyond its ends, every number is ``OUTSIDE``.

    A read of memory that does not belong to a field may end the process, or give another number on every run. Both
    would say nothing about a method whose index is wrong.
    """

    def __init__(self, field: Any) -> None:
        self.field = field

    def __getitem__(self, indices: Any) -> Any:
        """One element; Taichi asks for it when it compiles a kernel."""
        if not inside_kernel():
            return self.field[indices]
        is_pair = isinstance(indices, (tuple, list))
        return read_guarded(self.field, *indices) if is_pair else read_at(self.field, indices)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.field, name)


@ti.func
def read_guarded(field: ti.template(), i, j):
    """Element (i, j) of a field; ``OUTSIDE`` where there is none. An index of NaN is none."""
    rows, columns = ti.static(field.shape)
    is_inside = i >= 0 and i < rows and j >= 0 and j < columns
    value = field[ti.select(is_inside, i, 0), ti.select(is_inside, j, 0)]
    return ti.select(is_inside, value, 0 * value + OUTSIDE)


@ti.func
def read_at(field: ti.template(), place):
    """An element at a vector of two indices; see ``read_guarded``."""
    return read_guarded(field, place[0], place[1])


# ── functions for kernels ──

# The members of a hit that students write, as answers of ``rows``.
HIT = {
    "is_hit": WHOLE,
    "is_backfacing": WHOLE,
    "triangle_id": WHOLE,
    "material_id": WHOLE,
    "distance": 1,
    "barycentric_coords": 2,
    "normal": 3,
}


@ti.func
def members(hit):
    """The members of a ``tt.HitData`` in the order of ``HIT``."""
    is_hit, is_backfacing = ti.select(hit.is_hit != 0, 1, 0), ti.select(hit.is_backfacing != 0, 1, 0)
    return is_hit, is_backfacing, hit.triangle_id, hit.material_id, hit.distance, hit.barycentric_coords, hit.normal


# The members of a material that the BRDFs of the course read, and the sum of Blinn and Phong.
COLOURS = dict.fromkeys(("Ka", "Km", "Kd", "Ks", "Ke", "F0"), tm.vec3)
PlainMaterial = ti.types.struct(**COLOURS, **dict.fromkeys(("Ns", "alpha_x", "alpha_y"), tm.vec3.dtype))


@ti.func
def material_of(Kd, Ns):
    """A material with a reflectance and an exponent."""
    return PlainMaterial(Kd=Kd, Ks=tm.vec3(0.5), Ke=tm.vec3(0), Ns=Ns)


@ti.func
def rough_material_of(alpha, F0):
    """A rough metal whose tiny mirrors lie alike in all directions."""
    return PlainMaterial(Kd=F0, Ks=tm.vec3(0.5), Ke=tm.vec3(0), Ns=1.0, alpha_x=alpha, alpha_y=alpha, F0=F0)


# ── cameras ──


def met_planes(origin: np.ndarray, direction: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(3, …) t, u, v at which (…, 3) rays meet the planes of triangles, (…, 3, 3)."""
    v0, e1, e2 = corners[..., 0, :], corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    s = origin - v0
    pairs = (e2, np.cross(s, e1)), (s, np.cross(direction, e2)), (direction, np.cross(s, e1))
    with np.errstate(all="ignore"):
        return np.stack([(a * b).sum(axis=-1) for a, b in pairs]) / (e1 * np.cross(direction, e2)).sum(axis=-1)


def unit(vectors: np.ndarray) -> np.ndarray:
    """(…, 3) vectors with the length 1."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def directions(rng: np.random.Generator, count: int) -> np.ndarray:
    """(count, 3) unit directions, uniform on the sphere."""
    return unit(rng.normal(size=(count, 3)))


def picture_size(rng: np.random.Generator) -> Arrays:
    """The size of a picture that is not square, so that width and height cannot be confused."""
    short, more = rng.integers(12, 24), rng.integers(5, 14)
    width, height = rng.permutation([short, short + more])
    return {"width": np.array(width), "height": np.array(height)}


def views(rng: np.random.Generator, count: int) -> Arrays:
    """Random cameras: eye, at and up of (count, 3), and fov of (count,). None looks along its own up."""
    gaze, up = directions(rng, count), directions(rng, count)
    up = np.where(abs((gaze * up).sum(axis=1, keepdims=True)) > 0.9, np.roll(gaze, 1, axis=1), up)
    eye = rng.uniform(-3, 3, (count, 3))
    at = eye + gaze * rng.uniform(0.5, 4, (count, 1))
    up = up * rng.uniform(0.5, 2, (count, 1))
    return {"eye": eye, "at": at, "up": up, "fov": rng.uniform(25, 100, count)}


def places(rng: np.random.Generator) -> Arrays:
    """Cameras at 40 places."""
    return {name: array for name, array in views(rng, 40).items() if name != "fov"}


def run_matrix(camera_class: type, inputs: Arrays) -> Arrays:
    """The matrix of the camera at each place, from a method for Python or for kernels."""
    made, matrices = camera_class(8, 8), []
    for eye, at, up in zip(inputs["eye"], inputs["at"], inputs["up"], strict=True):
        made.set_camera_parameters(eye=eye, at=at, up=up)
        matrices.append(made.camera_to_world.to_numpy())
    return {"matrix": np.stack(matrices)}


@ti.func
def eye_ray(camera: ti.template(), pixel):
    """The ray of a pixel."""
    ray = camera.generate_ray(pixel.x, pixel.y)
    return ray.origin, ray.direction


def camera_of(cls: type, inputs: Arrays) -> Any:
    """The camera of the class under test whose size, and perhaps view, are among the inputs."""
    return cls(int(inputs["width"]), int(inputs["height"]), **view_of(inputs))


# A function that asks a camera for the ray of each "pixel".
RUN_EYE_RAYS = on_rows(eye_ray, ["pixel"], {"origin": 3, "direction": 3}, camera_of)


def front_view(rng: np.random.Generator) -> Arrays:
    """A camera in front of the Cornell box, or of the spheres."""
    eye = np.array([0, 1, 3]) + rng.uniform(-0.15, 0.15, 3)
    return {"eye": eye, "at": np.array([0.0, 1, 0]), "up": np.array([0.0, 1, 0]), "fov": np.array(60.0)}


VIEW = ("eye", "at", "up", "fov", "screen_window")


def view_of(inputs: Arrays) -> dict[str, Any]:
    """The view of a camera for its constructor: the inputs with the names in ``VIEW``."""
    return {name: inputs[name].tolist() for name in VIEW if name in inputs}


# ── scenes ──


def scene(inputs: Arrays) -> Any:
    """The scene of the inputs under its sky, the "image"; or with its lamps, which the handout's sampler samples.

    It is kept for the next class under test.
    """
    names = ("vertices", "faces", "materials", "Kd", "Ns")
    more = inputs.get("Ke", np.zeros_like(inputs["Kd"])), inputs.get("image", np.zeros(0))
    return cached(f"scene with {len(inputs['faces'])} faces", make_scene, *(inputs[name] for name in names), *more)


def make_scene(vertices, faces, ids, Kd, Ns, Ke, image) -> Any:
    """A scene from arrays."""
    materials = [tt.Material(f"m{i}", Kd=tuple(Kd[i]), Ns=float(Ns[i]), Ke=tuple(Ke[i])) for i in range(len(Ns))]
    options = {"environment": image} if image.size else {"lamp_choice": tt.MeshLightSampler}
    options |= {"material": materials, "face_materials": ids, "intersector": tt.BruteForceRayIntersector}
    options |= {"triangle_test": "moller_trumbore"}
    made = tt.scene_from_mesh(vertices, faces, **options)
    if not image.size:
        made.lamps.prepare()
    return made


@ti.func
def along_ray(method: ti.template(), origin, direction):
    """What a method of rays returns."""
    return method(tt.Ray(origin=origin, direction=direction))


def light_along(renderer: Any, inputs: Arrays, count: int) -> np.ndarray:
    """Statistics of ``count`` samples of ``shade_ray`` of each ray of the inputs."""
    radiance = bound(along_ray, renderer.shade_ray)
    return statistics(samples(radiance, inputs, ["origin", "direction"], {"radiance": 3}, count)["radiance"])


def run_integrators(names: Sequence[str], count: int) -> Callable[[type, Arrays], Arrays]:
    """A function that takes ``count`` samples of the light along each ray, by each of these integrators."""

    def run(renderer_class: type, inputs: Arrays) -> Arrays:
        lit, found = scene(inputs), {}
        for name in names:
            found[f"radiance ({name})"] = light_along(renderer_class(lit, 8, 8).use(name), inputs, count)
        return found

    return run


# ── noisy pictures ──

SIZE, BATCHES, SPP = 32, 8, 8  # pixels along a side; how many pictures; samples of each


def any_seed(rng: np.random.Generator) -> Arrays:
    """The seed of a picture."""
    return {"seed": np.array(rng.integers(0, 1000))}


def noisy_picture(renderer: Any, first_seed: int) -> Arrays:
    """The mean of several pictures with different seeds, and its standard error; the scene is not used afterwards."""
    pictures = []
    for batch in range(BATCHES):
        renderer.seed = first_seed + batch
        renderer.begin_anew()
        pictures.append(np.asarray(renderer.render(SPP).image()))
    renderer.scene_data.destroy()
    return {"picture": np.mean(pictures, axis=0), "error": np.std(pictures, axis=0, ddof=1) / BATCHES**0.5}


def lit_cornell_box(renderer_class: type, integrator: str, lamp_choice: type, inputs: Arrays) -> Arrays:
    """A noisy picture of the Cornell box, whose lamps ``lamp_choice`` samples; the inputs are those of ``any_seed``."""
    scene = tt.load_scene_data("cornell_box", lamp_choice=lamp_choice)
    renderer = renderer_class(scene, SIZE, SIZE).use(integrator)
    scene.lamps.prepare()
    return noisy_picture(renderer, int(inputs["seed"]))


# ── rooms with lamps ──


def quads(count: int) -> np.ndarray:
    """(2 count, 3) faces of quadrilaterals with four vertices each, one after the other."""
    return np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * k for k in range(count)]).astype(np.int32)


SMALL = 0.2  # times the size in which scenes are described here


def turned(rng: np.random.Generator, inputs: Arrays) -> Arrays:
    """The same scene, turned and small: no plane lies along the axes, so that hits are rounded to both of its sides.

    A ray that begins at a hit, and not beside the surface, often meets the surface itself. The scene is so small that
    the offset of 1e-6, which the course uses, is larger than this rounding.
    """
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    vertices, origin = (SMALL * np.asarray(inputs[name], np.float64) @ turn.T for name in ("vertices", "origin"))
    direction = unit(np.asarray(inputs["direction"], np.float64) @ turn.T)
    changed = {"origin": origin.astype(np.float32), "direction": direction.astype(np.float32)}
    return {**inputs, "vertices": vertices.astype(np.float32).astype(np.float64), **changed}


def lamp_room(rng: np.random.Generator) -> Arrays:
    """A floor, half diffuse and half glossy, and a wall; a lamp above, and one at the wall that the floor mirrors.

    A third lamp hides a part of the first one from the floor: whoever chose a point there gets nothing from it.
    The lamps do not reflect: then it makes no difference whether a path goes on where it has met one.

    Rays lead to the surfaces, and one to a lamp.
    """
    down = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], np.float64)
    up, forward = down[::-1], down[::-1][:, [0, 2, 1]] * [1, -1, 1]
    corners = [
        3 * up,
        forward * [2, 1, 1] + [0, 1, -2],
        down * rng.uniform(0.25, 0.5) + [-0.8, 1.6, 0],
        forward * [0.8, 0.35, 1] + [0.1, 0.5, -1.95],
        down * rng.uniform(0.35, 0.5) + [-0.4, 0.8, 0],
    ]
    on_floor = rng.uniform([-1, 0, -1], [1, 0, 1], (6, 3))
    on_wall = rng.uniform([-1, 1.1, -2], [1, 1.5, -2], (2, 3))
    eye = np.array([0.2, 1.0, 5.0])
    target = np.concatenate([on_floor, on_wall, [[0.25, 0.55, -1.95]]])  # no edge is near
    room = {
        "origin": np.tile(eye, (len(target), 1)).astype(np.float32),
        "direction": unit(target - eye).astype(np.float32),
        "vertices": np.concatenate(corners),
        "faces": quads(5),
        "materials": np.array([0, 1, 0, 0, 2, 2, 3, 3, 4, 4], np.int32),
        "Kd": np.concatenate([rng.uniform(0.2, 0.5, (2, 3)), np.zeros((3, 3))]),
        "Ns": np.array([1.0, rng.uniform(20, 40), 1, 1, 1]),
        "Ke": np.concatenate([np.zeros((2, 3)), rng.uniform(2, 6, (3, 3))]),
    }
    return turned(rng, room)


def closed_room(rng: np.random.Generator) -> Arrays:
    """A cube that is seen from within: one of two opposite sides emits, the others reflect, and two are glossy.

    Every side is hit by at least one of the rays.
    """
    count = 9
    is_lamp = np.arange(6)[:, None] == rng.integers(0, 2)
    vertices = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]  # fronts inside
    faces = [triangle for a, b, c, d in sides for triangle in ((a, b, c), (a, c, d))]
    ray = np.arange(count)
    origin, target = rng.uniform(-0.5, 0.5, (count, 3)), rng.uniform(-0.9, 0.9, (count, 3))
    target[ray, ray % 3] = np.where(ray // 3 % 2, 1, -1)
    return {
        "origin": origin.astype(np.float32),
        "direction": unit(target - origin).astype(np.float32),
        "vertices": vertices,
        "faces": np.array(faces, np.int32),
        "materials": np.repeat(np.arange(6), 2).astype(np.int32),
        "Kd": np.where(is_lamp, 0, rng.uniform(0.5, 0.9, (6, 3))),
        "Ns": np.array([1.0, 1, 1, 1, 8, 12]),
        "Ke": np.where(is_lamp, rng.uniform(0.5, 1.5, (6, 3)), 0),
    }
