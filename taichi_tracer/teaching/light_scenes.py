"""Rooms with lamps, as arrays: where the light of assignments 3 and 4 is checked."""

import numpy as np

from taichi_tracer.teaching.base import Arrays
from taichi_tracer.teaching.fixtures import unit


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
