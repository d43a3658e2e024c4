"""What is checked of RT3's light: four lights, the highlight, the sum with its shadows, mirrors, and a picture."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.brdfs.surface import Surface
from taichi_tracer.contracts.lab import bound
from taichi_tracer.geometry import Mesh
from taichi_tracer.teaching import fixtures
from taichi_tracer.teaching.base import Arrays, Numbers, method, picture
from taichi_tracer.teaching.fixtures import rows

LIGHTS, CONES, AMBIENT = "lights", "spots", "ambient light"
HIGHLIGHTS, SUM, MIRRORS = "Blinn's highlight", "Blinn–Phong", "mirrors"
COUNT = 6  # lights of each kind
POINT = ("position", "intensity", "attenuation")  # what makes a light
SPOT = ("position", "target", "intensity", "cutoff", "falloff", "attenuation")
f32 = np.float32
NOTHING = tm.vec3(0)  # is added to what a method returns: Taichi ends the process if it assigns None


def colours(rng: np.random.Generator, count: int) -> np.ndarray:
    """(count, 3) reflectances."""
    return rng.uniform(0.1, 1, (count, 3)).astype(f32)


# ── one light ──


def points(rng: np.random.Generator) -> Arrays:
    """Forty points that each light lights; x is first relative to the light."""
    which = np.repeat(np.arange(COUNT), 40).astype(np.int32)
    offset = fixtures.directions(rng, len(which)) * rng.uniform(0.4, 4, (len(which), 1))
    position = rng.uniform(-2, 2, (COUNT, 3))
    intensity = rng.uniform(4, 20, (COUNT, 3))
    attenuation = rng.uniform(0.1, 1, (COUNT, 3))
    attenuation[0], attenuation[1] = (0, 0, 1), (1, 0, 0)
    x = (position[which] + offset).astype(f32)
    return {"x": x, "light": which, "position": position, "intensity": intensity, "attenuation": attenuation}


@ti.func
def of_one(lights: ti.template(), ask: ti.template(), which, given):
    """The numbers that ``ask`` gets from one of the lights."""
    numbers = ask(lights[0], given)
    for k in ti.static(range(1, len(lights))):
        if which == k:
            numbers = ask(lights[k], given)
    return numbers


def run_lights(names: Sequence[str], ask: Callable, given: str, answers: Mapping[str, int]) -> Callable:
    """A function that asks one light for each row of the inputs.

    Args:
        names: of the inputs that make the lights. given: that of the input which ``ask`` gets beside the light.
        ask: a ``ti.func`` that returns the numbers of all answers, in one vector.
    """

    def run(light_class: type, inputs: Arrays) -> Arrays:
        lights = [light_class(*made) for made in zip(*(inputs[name].tolist() for name in names), strict=True)]
        function, width = bound(of_one, lights, ask), sum(answers.values())
        numbers = rows(function, inputs, ["light", given], {"numbers": width})["numbers"]
        columns = np.split(numbers, np.cumsum(list(answers.values()))[:-1], axis=1)
        answered = zip(answers, columns, strict=True)
        return {name: column if answers[name] > 1 else column[:, 0] for name, column in answered}

    return run


@ti.func
def sampled(light: ti.template(), x):
    """Direction, distance, light and density of a sample."""
    w_i, distance, arriving, pdf = light.sample(x, tm.vec2(0.5))
    return ti.Vector([w_i.x, w_i.y, w_i.z, distance, arriving.x, arriving.y, arriving.z, pdf])


def run_sample(*names: str) -> Callable[[type, Arrays], Arrays]:
    """A function that calls ``sample`` of the lights that the inputs with these names describe."""
    return run_lights(names, sampled, "x", {"direction": 3, "distance": 1, "arriving": 3, "density": 1})


def points_far_away(rng: np.random.Generator) -> Arrays:
    """Ten points in each of six parallel lights, whose directions are of any length."""
    which = np.repeat(np.arange(COUNT), 10).astype(np.int32)
    way = fixtures.directions(rng, COUNT) * rng.uniform(1.5, 4, (COUNT, 1))
    x = rng.uniform(-3, 3, (len(which), 3)).astype(f32)
    return {"x": x, "light": which, "way": way, "irradiance": rng.uniform(0.5, 4, (COUNT, 3))}


def points_in_cones(rng: np.random.Generator) -> Arrays:
    """Points around the axes of six spots: most between the two angles, some on the axis, some outside.

    The last two spots are full on the axis alone. None of their points is so near to it that acos would be inexact.
    """
    found = points(rng)
    which, position = found["light"], found["position"]
    count, far = len(which), rng.uniform(0.4, 4, (len(which), 1))
    target = position + fixtures.directions(rng, COUNT) * rng.uniform(1.5, 3, (COUNT, 1))
    falloff = rng.uniform(8, 20, COUNT).round() * (np.arange(COUNT) < 4)
    cutoff = falloff + rng.uniform(15, 40, COUNT).round()
    low, high = np.maximum(falloff, 4)[which], cutoff[which]
    theta, kind, has_middle = rng.uniform(low, high), np.arange(count) % 6, which < 4
    theta = np.where((kind == 0) & has_middle, 0.7 * low, theta)
    theta = np.where(kind == 1, high + rng.uniform(2, 40, count), theta)
    axis = fixtures.unit(target - position)[which]
    side = fixtures.unit(np.cross(axis, fixtures.directions(rng, count)))
    turned = np.radians(theta)[:, None]
    x = position[which] + (np.cos(turned) * axis + np.sin(turned) * side) * far
    on_axis = (kind == 2) & has_middle
    x[on_axis] = rounded_up(rng, position.astype(f32), target.astype(f32), which[on_axis])
    return {**found, "x": x.astype(f32), "target": target, "cutoff": cutoff, "falloff": falloff}


def rounded_up(rng: np.random.Generator, position: np.ndarray, target: np.ndarray, which: np.ndarray) -> np.ndarray:
    """(n, 3) points on the axes: those of 50 each at which rounding makes the cosine of the angle the largest."""
    axis = fixtures.unit(target - position)[which][:, None]
    x = (position[which][:, None] + axis * rng.uniform(0.4, 4, (len(which), 50, 1))).astype(f32)
    cosine = (fixtures.unit(x - position[which][:, None]) * axis).sum(axis=2)
    return x[np.arange(len(which)), cosine.argmax(axis=1)]


def angles(rng: np.random.Generator) -> Arrays:
    """For each of six spots, pairs of angles: one that is partly lit, and any one; the last spot has a sharp edge."""
    found = points_in_cones(rng)
    which, low, high = found["light"], found["falloff"], found["cutoff"]
    low[-1] = high[-1]
    between, other = rng.uniform(low[which], high[which]), rng.uniform(0, 80, len(which))
    between[which == COUNT - 1] = rng.uniform(0, high[-1] - 1, 40)
    other[which == COUNT - 1] = rng.uniform(high[-1] + 1, 90, 40)
    is_smooth = which < COUNT - 1
    other[is_smooth & (np.arange(len(which)) % 5 == 0)] = 0
    other[::10] = np.where(is_smooth, low[which], other)[::10]
    other[5::10] = np.where(is_smooth, high[which], other)[5::10]
    del found["x"]
    return {**found, "theta": np.stack([between, other], axis=1).astype(f32)}


@ti.func
def shares(light: ti.template(), theta):
    """The shares at two angles."""
    return tm.vec2(light.share(theta.x), light.share(theta.y))


def materials(rng: np.random.Generator) -> Arrays:
    """Forty materials for each of six ambient lights."""
    which, I = np.repeat(np.arange(COUNT), 40).astype(np.int32), rng.uniform(0.05, 3, (COUNT, 3))
    return {"light": which, "I": I, "Ka": colours(rng, len(which)), "Kd": colours(rng, len(which))}


@ti.func
def shown(light: ti.template(), material):
    """What a surface shows of an ambient light."""
    return NOTHING + light.reflected(material)


@ti.func
def shown_of_one(lights: ti.template(), which, Ka, Kd):
    """What a surface shows of one of the lights; other colours of it are white."""
    return of_one(lights, shown, which, fixtures.PlainMaterial(Ka=Ka, Kd=Kd, Ks=tm.vec3(1), Km=tm.vec3(1), Ns=1))


def run_ambient(light_class: type, inputs: Arrays) -> Arrays:
    """What each material shows of its light."""
    lights = [light_class(intensity) for intensity in inputs["I"].tolist()]
    return rows(bound(shown_of_one, lights), inputs, ["light", "Ka", "Kd"], {"light": 3})


# ── one surface ──


def surfaces(rng: np.random.Generator, count: int) -> Arrays:
    """Surfaces that are seen from the front, with interpolated normals that differ from those of their triangles."""
    n = fixtures.unit([0, 1, 0] + 0.7 * fixtures.directions(rng, count))
    flat = fixtures.unit(n + 0.35 * fixtures.directions(rng, count))
    Ns = np.exp(rng.uniform(np.log(2), np.log(60), count)).astype(f32)
    return {"Ns": Ns, "normal": n.astype(f32), "geometric_normal": flat.astype(f32), "w_o": seen(rng, n, flat)}


def seen(rng: np.random.Generator, n: np.ndarray, flat: np.ndarray) -> np.ndarray:
    """(count, 3) directions to the viewer, above both planes."""
    return fixtures.unit(n + flat + 1.2 * fixtures.directions(rng, len(n))).astype(f32)


def pairs_of_lights(rng: np.random.Generator) -> Arrays:
    """Surfaces with two lights: one near the middle of the highlight, and one anywhere, also behind the surface.

    Every fourth surface has a wide lobe, and is lit from behind and seen from the side: n·h is far below 0.
    """
    found, count = surfaces(rng, 300), 300
    n, is_behind = found["normal"].astype(np.float64), np.arange(count) % 4 == 0
    side = fixtures.unit(np.cross(n, fixtures.directions(rng, count)))
    w_o = np.where(is_behind[:, None], fixtures.unit(side + 0.2 * n), found["w_o"])
    any_light = fixtures.directions(rng, count)
    behind = fixtures.unit(0.2 * any_light - n)
    found["Ns"] = np.where(is_behind, rng.uniform(1.5, 5, count), found["Ns"]).astype(f32)
    cosine = (n * w_o).sum(axis=1, keepdims=True)
    offset = cosine * rng.uniform(0.2, 0.6, (count, 1)) * fixtures.directions(rng, count)
    near = fixtures.unit(2 * cosine * n - w_o + offset)
    l2 = np.where(is_behind[:, None], behind, any_light)
    return {**found, "w_o": w_o.astype(f32), "l": near.astype(f32), "l2": l2.astype(f32)}


SURFACE = ["normal", "geometric_normal", "w_o", "Ns"]


@ti.func
def surface_of(x, n, flat, w_o, Ns, Ka, Kd, Ks):
    """A surface without a scene."""
    hit = tt.no_hit()
    hit.normal, hit.geometric_normal = n, flat
    material = fixtures.PlainMaterial(Ka=Ka, Kd=Kd, Ks=Ks, Km=tm.vec3(1), Ns=Ns)
    return Surface({}, 0, material, x, hit, w_o)


def run_highlight(integrator_class: type, inputs: Arrays) -> Arrays:
    """The highlights of two lights on each surface."""
    integrator = integrator_class()

    @ti.func
    def both(l, l2, n, flat, w_o, Ns):
        surface = surface_of(tm.vec3(0), n, flat, w_o, Ns, tm.vec3(1), tm.vec3(1), tm.vec3(1))
        found = tm.vec2(integrator.highlight(surface, l), integrator.highlight(surface, l2))
        return found.x, found.y

    return rows(both, inputs, ["l", "l2", *SURFACE], {"highlight": 1, "highlight of l2": 1})


# ── the sum of all lights ──


def lit_surfaces(rng: np.random.Generator) -> Arrays:
    """Surfaces on a floor, under a sun, a lamp and a spot. One ball casts shadows.

    Two balls must cast none: one above the lamp, and one below the floor.
    At four of ten surfaces, the lamp is near the horizon, above one of the two planes and below the other.
    """
    count = 240
    lamp = np.array([-1, 2, 0]) + rng.uniform(-0.1, 0.1, 3)
    x = rng.uniform([-1.5, 0, -1.5], [1.5, 0.3, 1.5], (count, 3))
    found = surfaces(rng, count)
    l = fixtures.unit(lamp - x)
    level = fixtures.unit(np.cross(l, fixtures.directions(rng, count)))
    tilt = rng.uniform(0.12, 0.3, (count, 2, 1)) * [[[1], [-1]]]
    below, above = (fixtures.unit(level + tilt[:, i] * l) for i in (1, 0))
    kind = np.arange(count) % 10
    n = np.where((kind < 2)[:, None], below, np.where((kind < 4)[:, None], above, found["normal"]))
    flat = np.where((kind < 4)[:, None], np.where((kind < 2)[:, None], above, below), found["geometric_normal"])
    given = {"x": x.astype(f32), "normal": n.astype(f32), "geometric_normal": flat.astype(f32)}
    given |= {"w_o": seen(rng, n, flat), "Ns": found["Ns"]}
    given |= {name: colours(rng, count) for name in ("Ka", "Kd", "Ks")}
    spot = np.array([[1, 2.2, 0.5], [0.5, 0, -0.1]]) + rng.uniform(-0.1, 0.1, (2, 3))
    balls = np.array([[-1, 2.9, 0, 0.6], [0.6, 1.1, 0.1, 0.35], [0.2, -1.4, 0, 0.8]])
    strength = rng.uniform(0.5, 1, (5, 3)) * np.array([0.2, 0.1, 1, 6, 9])[:, None]
    return {**given, "lamp": lamp, "spot": spot, "balls": balls, "strength": strength}


def make_lit_scene(lamp, spot, strength, balls) -> Any:
    """Balls, of which only the shadows matter, and two ambient lights, a sun, a lamp and a spot."""
    ambient, more, sun, point, cone = strength.tolist()
    lights: list = [tt.AmbientLight(ambient), tt.AmbientLight(more), tt.DirectionalLight((0.4, -1, 0.3), sun)]
    lights += [tt.PointLight(lamp.tolist(), point, (0.5, 0.2, 0.6))]
    lights += [tt.SpotLight(*spot.tolist(), cone, 55, 25, (1, 0, 0.4))]
    mesh = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32), spheres=balls)
    return tt.SceneData(mesh, lights=lights, intersector=tt.BruteForceRayIntersector)


def run_shade(integrator_class: type, inputs: Arrays) -> Arrays:
    """What each surface sends to the viewer."""
    given = (inputs[name] for name in ("lamp", "spot", "strength", "balls"))
    scene, integrator = fixtures.cached("balls", make_lit_scene, *given).in_kernels(), integrator_class()

    @ti.func
    def shaded(x, n, flat, w_o, Ns, Ka, Kd, Ks):
        return integrator.shade(scene, surface_of(x, n, flat, w_o, Ns, Ka, Kd, Ks))

    return rows(shaded, inputs, ["x", *SURFACE, "Ka", "Kd", "Ks"], {"radiance": 3})


# ── mirrors ──


def mirror_room(rng: np.random.Generator) -> Arrays:
    """A floor, two walls that mirror each other, and a panel that is seen from its back; and pairs of rays.

    The first ray of a pair meets a wall or the floor. The second one may meet the panel's back, or nothing.
    """
    square = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], np.float64)
    wall = square[::-1][:, [0, 2, 1]] * [2, 1.2, 1] + [0, 1.2, -2]
    front = wall[::-1] * [1, 1, -1]
    panel = square[::-1][:, [1, 0, 2]] * [1, 0.6, 0.6] + [1.4, 0.8, 0.2]
    vertices = np.concatenate([2.5 * square, wall, front, panel])
    count = 80
    eye = rng.uniform([-0.4, 1, 0.8], [0.4, 1.4, 1.4], (count, 3))
    at = np.where(
        (np.arange(count) % 4 == 0)[:, None],
        rng.uniform([-1, 0, -1.5], [1, 0, 0], (count, 3)),
        rng.uniform([-1.3, 0.3, -2], [1.3, 2, -2], (count, 3)),
    )
    other = np.stack([at, rng.uniform([1.4, 0.5, 0], [1.4, 1.1, 0.4], (count, 3)), eye + [0.2, 3, -1]])
    at2 = other[rng.integers(0, 3, count), np.arange(count)]
    return {
        "origin": eye.astype(f32),
        "direction": fixtures.unit(at - eye).astype(f32),
        "direction2": fixtures.unit(at2 - eye).astype(f32),
        "vertices": vertices,
        "materials": rng.uniform(0.2, 0.9, (4, 13)),
        "sky": rng.uniform(0.3, 1, 3),
    }


def make_room(vertices, materials, sky) -> Any:
    """The scene of a room."""
    made = [tt.Material(Ka=one[:3], Kd=one[3:6], Ks=one[6:9], Km=one[9:12], Ns=40 * one[12]) for one in materials]
    lights: list = [tt.AmbientLight(0.2), tt.PointLight((0.2, 2, 0), 2.0), tt.DirectionalLight((0.3, -1, -0.4), 0.6)]
    options = {"material": made, "face_materials": np.repeat(np.arange(4), 2), "lights": lights}
    options |= {"environment": np.broadcast_to(sky, (2, 4, 3)), "intersector": tt.BruteForceRayIntersector}
    return tt.scene_from_mesh(vertices, fixtures.quads(4), **options)


def run_radiance(integrator_class: type, inputs: Arrays) -> Arrays:
    """The light along both rays of each pair, with at most three mirrors."""
    given = (inputs[name] for name in ("vertices", "materials", "sky"))
    scene = fixtures.cached("room of mirrors", make_room, *given).in_kernels()
    integrator = integrator_class(3)

    @ti.func
    def both(origin, direction, direction2):
        first, second = tm.vec3(0), tm.vec3(0)
        for i in range(2):  # a loop, so that the method is compiled once
            ray = tt.Ray(origin=origin, direction=direction + i * (direction2 - direction))
            light = NOTHING + integrator.radiance(scene, ray, scene.ray_intersector.query_ray(ray), 0)
            first, second = ti.select(i == 0, light, first), light
        return first, second

    return rows(both, inputs, ["origin", "direction", "direction2"], {"radiance": 3, "radiance2": 3})


# ── a picture ──


def balls_view(rng: np.random.Generator) -> Arrays:
    """A camera in front of the three balls of RT3."""
    eye = np.array([0, 3, -9]) + rng.uniform(-0.2, 0.2, 3)
    return {"eye": eye, "at": np.array([0, 0.9, 0]), "up": np.array([0.0, 1, 0]), "fov": np.array(36.0)}


def run_picture(classes, inputs: Arrays) -> Arrays:
    """Three balls under all four lights."""
    scene = tt.load_scene_data("rt3/all_lights")
    lamp = classes.PointLight((0.4, 3.2, -1.2), (6, 4.5, 2.7), (1, 0, 1))
    spot = classes.SpotLight((5, 5, -3), (2.3, 0.6, 0), (3, 8, 30), 16, 11)
    scene.lights = [classes.AmbientLight(0.12), classes.DirectionalLight((4, -5, 6), 0.35), lamp, spot]
    camera = tt.Camera(64, 40, **fixtures.view_of(inputs))
    found = np.asarray(tt.RT3Renderer(scene, camera=camera).use(classes.BlinnPhong(4)).render().image())
    scene.destroy()
    return {"picture": found}


POINTS, SURFACES = Numbers(1e-3, called="points"), Numbers(1e-3, called="surfaces")
PARTS = (
    method("PointLight.sample", 3, LIGHTS, points, run_sample(*POINT), POINTS),
    method("DirectionalLight.sample", 2, LIGHTS, points_far_away, run_sample("way", "irradiance"), POINTS),
    method(
        "SpotLight.share",
        2,
        CONES,
        angles,
        run_lights(SPOT, shares, "theta", {"share": 2}),
        Numbers(1e-4, called="pairs of angles"),
    ),
    method("SpotLight.sample", 3, CONES, points_in_cones, run_sample(*SPOT), POINTS),
    method("AmbientLight.reflected", 1, AMBIENT, materials, run_ambient, SURFACES),
    method("BlinnPhong.highlight", 3, HIGHLIGHTS, pairs_of_lights, run_highlight, SURFACES),
    method("BlinnPhong.shade", 5, SUM, lit_surfaces, run_shade, SURFACES),
    method("BlinnPhong.radiance", 4, MIRRORS, mirror_room, run_radiance, Numbers(1e-3, called="pairs of rays")),
    picture("three balls", 2, balls_view, run_picture),
)
