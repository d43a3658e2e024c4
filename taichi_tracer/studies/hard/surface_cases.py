"""Hard cases of surfaces and of the lights at them: microfacets, textures without an extent, lights inside surfaces."""

import itertools

import numpy as np

from taichi_tracer.brdfs.microfacet import LAYERED
from taichi_tracer.brdfs.rough_layer import LAYER_F0, LEAST
from taichi_tracer.camera import Camera
from taichi_tracer.lights.point_light import PointLight
from taichi_tracer.lights.spot_light import SpotLight
from taichi_tracer.materials import Material
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import scene_from_mesh
from taichi_tracer.studies.hard.case import renderer_case
from taichi_tracer.studies.hard.meshes import join, sphere
from taichi_tracer.studies.hard.path_cases import (
    ALBEDO,
    FLOOR,
    PIXEL,
    floor_points,
    from_above,
    mesh_of,
    path_renderer,
    quad,
    rendered,
    square,
)
from taichi_tracer.studies.hard.shading_cases import check_answers, check_energy
from taichi_tracer.system.errors import InputError
from taichi_tracer.textures import Texture

ALPHAS = (1e-6, 6e-5, 1e-4, 1e-3, 0.03, 0.3, 1.0)
TO_GRAZING = (1.0, 0.5, 0.05, 1e-3, 1e-6)  # cosines of views


def metals(**values) -> list[Material]:
    """White materials with every pair of roughnesses."""
    pairs = itertools.product(ALPHAS, ALPHAS)
    return [Material(**{"Kd": (1.0,) * 3, "F0": 1.0, "alpha_x": x, "alpha_y": y} | values) for x, y in pairs]


@renderer_case("microfacets: α 1e-6 to 1, views down to 1e-6 rad")
def microfacets(found, epsilon):
    """Metals with α from 1e-6 to 1, different along x and y, down to 1e-6 rad above the surface and from below it.

    D is 1/(π α⁴) beside a peak that is α wide, and G is 0/0 along the surface. The two must cancel on paper: as
    quotients of rounded numbers, they are infinite, NaN, or make energy out of nothing.
    """
    check_answers(found, epsilon, metals())
    check_energy(found, metals(), TO_GRAZING)


@renderer_case("rough layers: α 1e-6 to 1, views down to 1e-6 rad")
def rough_layers(found, epsilon):
    """A white base under such a layer, as in glTF files: a sample goes to one of them, and both reflect.

    If the two densities are not mixed as the samples are, or if the base gets light that the layer has reflected, a
    white surface reflects more than it receives, at grazing angles first. The weight of a sample of the mixture is at
    most that of a part, divided by the probability of this part.
    """
    layers = metals(F0=(LAYER_F0,) * 3, extra={LAYERED: (1.0,)})  # with the reflectance of glass
    check_answers(found, epsilon, layers, most_weight=1 / LEAST)
    check_energy(found, layers, TO_GRAZING)


@renderer_case("texture coordinates: equal, far away, NaN")
def degenerate_coordinates(found, epsilon):
    """Texture coordinates that are all equal, that are farther away than f32 counts texels, or that are no numbers.

    A triangle whose corners have one coordinate has no extent in the picture: what divides by it is 0/0. ⌊1e30⌋ as a
    whole number is anything, and the texel with this number lies outside the memory of the picture. Each must show a
    colour of the picture, of which the light is a multiple; NaN is refused, with the name uv.
    """
    places = (0.0, 0.25, 1.0, -7.5, 1e7, -1e30, 3e38)
    half = len(places)
    strips = [quad((x, 0, half), (x + 2, 0, half), (x + 2, 0, -half), (x, 0, -half)) for x in range(-half, half, 2)]
    vertices, faces = join(strips)
    uv = np.repeat(places, 6)[:, None] * np.ones(2)  # of the six corners of each strip
    pixels = np.random.default_rng(3).random((3, 5, 3))
    material = Material(Kd=(1.0,) * 3, map_Kd=Texture(pixels))
    scene = scene_from_mesh(vertices, faces, uv=uv, material=material, environment=np.ones((1, 1, 3)))
    renderer = A2Renderer(scene, camera=from_above(5 * half, half), jitter=False)
    image, _, nan = rendered(renderer, "brdf", 1)
    color = renderer.aov("albedo")
    found.add((color < pixels.min() - epsilon) | (color > pixels.max() + epsilon), nan)
    found.add(np.abs(image - color) > 8 * max(epsilon, PIXEL), tried=0)
    for value in (np.nan, np.inf):
        try:
            scene_from_mesh(vertices, faces, uv=np.full((len(vertices), 2), value))
            found.add(True)
        except InputError as error:
            found.add("uv" not in str(error))


@renderer_case("a light inside a surface")
def light_inside(found, epsilon):
    """A point that shines from inside a closed sphere, and points that lie in the plane of a floor.

    A shadow ray that starts a little behind its surface, or that passes between two triangles, lets the light out. The
    way to a light at the point that it lights has the length 0: 0/0 is its direction, and 1/0 its radiance. From
    outside, all must be black; inside, light arrives everywhere; in the plane of the floor, all is finite.
    """
    ball = sphere(24, 12, 0.5, (0.1, 0.7, -0.1))
    mesh = mesh_of([square(2), ball], [FLOOR, FLOOR])
    scene = SceneData(mesh, lights=[PointLight((0.15, 0.75, -0.05))])
    outside, inside = from_above(33, 2.0, 4), Camera(24, 24, eye=(0.1, 0.7, -0.5), at=(0.1, 0.7, 0), fov=80)
    for camera, is_lit in ((outside, False), (inside, True)):
        image, _, nan = rendered(path_renderer(scene, camera), "explicit", 1)
        found.add((image > 0).any(axis=2) != is_lit, nan)
    lights = [PointLight(place) for place in ((0.0, 0, 0), (2.0, 0, 2), (0.5, 1e-30, 0.25))]
    scene = SceneData(mesh_of([square(2)], [FLOOR]), lights=lights)
    image, _, nan = rendered(path_renderer(scene, outside), "explicit", 1)
    found.add((image < 0).any(axis=2), nan)


@renderer_case("spots of zero angle, and without a soft edge")
def spot_angles(found, epsilon):
    """Spots in one place whose two angles are equal: 0, 30, 90 and 180 degrees.

    Between the two angles, the light falls linearly: (cutoff − θ)/(cutoff − falloff) is 0/0 if they are equal. The
    angle to the axis is an acos of a number that may be a rounding above 1, which is NaN in the middle of the light.
    The floor must show the sum of s(θ) I cos θ/r² of all, each of them black beyond its cutoff.
    """
    size, half, height = 33, 2.0, 1.0
    near = 1e-3  # degrees to the border of the light, where rounding decides
    lines, cones = ((0.0, 0.0), (1e-30, 0.0)), ((30.0, 30.0), (90.0, 90.0), (180.0, 180.0), (60.0, 0.0))
    points = floor_points(size, half)
    r = np.sqrt((points**2).sum(axis=2) + height**2)
    theta = np.degrees(np.arctan2(np.linalg.norm(points, axis=2), height))
    for angles in (lines, cones):  # apart, because the border of a line is the middle of a cone
        strengths = [(2.0**-k, *pair) for k, pair in enumerate(angles)]  # so that two errors do not cancel
        spots = [SpotLight((0, height, 0), (0, 0, 0), *values) for values in strengths]
        scene = SceneData(mesh_of([square(half)], [FLOOR]), lights=spots)
        image, _, nan = rendered(path_renderer(scene, from_above(size, half, 0.5)), "explicit", 1)
        sure, truth = np.ones(theta.shape, bool), np.zeros(theta.shape)
        for intensity, cutoff, falloff in strengths:
            share = np.clip((cutoff - theta) / max(cutoff - falloff, 1e-300), 0, 1)
            truth += ALBEDO / np.pi * intensity * share * height / r**3
            sure &= np.abs(theta - cutoff) > near
        found.add(sure & ~(np.abs(image[..., 0] - truth) <= 1e-5), nan)
