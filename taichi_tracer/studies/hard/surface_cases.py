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
from taichi_tracer.studies.hard.case import RendererCase
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
from taichi_tracer.studies.hard.shading_cases import Brdfs
from taichi_tracer.system.errors import InputError
from taichi_tracer.textures import Texture


class Microfacets(Brdfs):
    """Metals with α from 1e-6 to 1, different along x and y, down to 1e-6 rad above the surface and from below it.

    D is 1/(π α⁴) beside a peak that is α wide, and G is 0/0 along the surface. The two must cancel on paper: as
    quotients of rounded numbers, they are infinite, NaN, or make energy out of nothing.
    """

    what = "α 1e-6 to 1, views down to 1e-6 rad"
    name = f"microfacets: {what}"
    alphas = (1e-6, 6e-5, 1e-4, 1e-3, 0.03, 0.3, 1.0)
    views_from_above = (1.0, 0.5, 0.05, 1e-3, 1e-6)
    extra: dict = {}

    def materials(self) -> list[Material]:
        """White metals with every pair of roughnesses."""
        pairs = itertools.product(self.alphas, self.alphas)
        return [Material(Kd=(1.0,) * 3, F0=1.0, alpha_x=x, alpha_y=y, extra=self.extra) for x, y in pairs]

    def check(self, found, epsilon):
        """As for other BRDFs; and a surface reflects no more than it receives."""
        super().check(found, epsilon)
        self.check_energy(found)


class RoughLayers(Microfacets):
    """A white base under such a layer, as in glTF files: a sample goes to one of them, and both reflect.

    If the two densities are not mixed as the samples are, or if the base gets light that the layer has reflected, a
    white surface reflects more than it receives, at grazing angles first.
    """

    name = f"rough layers: {Microfacets.what}"
    most_weight = 1 / LEAST  # of a sample of the mixture: that of a part, divided by the probability of this part
    extra = {LAYERED: (1.0,)}

    def materials(self) -> list[Material]:
        """With the reflectance of glass."""
        return [Material(**(vars(m) | {"F0": (LAYER_F0,) * 3})) for m in super().materials()]


class DegenerateCoordinates(RendererCase):
    """Texture coordinates that are all equal, that are farther away than f32 counts texels, or that are no numbers.

    A triangle whose corners have one coordinate has no extent in the picture: what divides by it is 0/0. ⌊1e30⌋ as a
    whole number is anything, and the texel with this number lies outside the memory of the picture.
    """

    name = "texture coordinates: equal, far away, NaN"
    places = (0.0, 0.25, 1.0, -7.5, 1e7, -1e30, 3e38)

    def check(self, found, epsilon):
        """Each shows a colour of the picture, of which the light is a multiple; NaN is refused and names uv."""
        half = len(self.places)
        strips = [quad((x, 0, half), (x + 2, 0, half), (x + 2, 0, -half), (x, 0, -half)) for x in range(-half, half, 2)]
        vertices, faces = join(strips)
        uv = np.repeat(self.places, 6)[:, None] * np.ones(2)  # of the six corners of each strip
        pixels = np.random.default_rng(3).random((3, 5, 3))
        material = Material(Kd=(1.0,) * 3, map_Kd=Texture(pixels))
        scene = scene_from_mesh(vertices, faces, uv=uv, material=material, environment=np.ones((1, 1, 3)))
        renderer = A2Renderer(scene, camera=from_above(5 * half, half), jitter=False)
        image, _, nan = rendered(renderer, "brdf", 1)
        color = renderer.aov("albedo")
        found.add((color < pixels.min() - epsilon) | (color > pixels.max() + epsilon), nan)
        found.add(np.abs(image - color) > 8 * max(epsilon, PIXEL), tried=0)
        for value in (np.nan, np.inf):
            found.add(not self._is_refused(vertices, faces, value))

    def _is_refused(self, vertices, faces, value) -> bool:
        try:
            scene_from_mesh(vertices, faces, uv=np.full((len(vertices), 2), value))
        except InputError as error:
            return "uv" in str(error)
        return False


class LightInside(RendererCase):
    """A point that shines from inside a closed sphere, and points that lie in the plane of a floor.

    A shadow ray that starts a little behind its surface, or that passes between two triangles, lets the light out. The
    way to a light at the point that it lights has the length 0: 0/0 is its direction, and 1/0 its radiance.
    """

    name = "a light inside a surface"

    def check(self, found, epsilon):
        """From outside, all is black; inside, light arrives everywhere; in the plane of the floor, all is finite."""
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


class SpotAngles(RendererCase):
    """Spots in one place whose two angles are equal: 0, 30, 90 and 180 degrees.

    Between the two angles, the light falls linearly: (cutoff − θ)/(cutoff − falloff) is 0/0 if they are equal. The
    angle to the axis is an acos of a number that may be a rounding above 1, which is NaN in the middle of the light.
    """

    name = "spots of zero angle, and without a soft edge"
    size, half, height = 33, 2.0, 1.0
    lines, cones = ((0.0, 0.0), (1e-30, 0.0)), ((30.0, 30.0), (90.0, 90.0), (180.0, 180.0), (60.0, 0.0))
    near = 1e-3  # degrees to the border of the light, where rounding decides

    def check(self, found, epsilon):
        """The floor shows the sum of s(θ) I cos θ/r² of all, each of them black beyond its cutoff."""
        points = floor_points(self.size, self.half)
        r = np.sqrt((points**2).sum(axis=2) + self.height**2)
        theta = np.degrees(np.arctan2(np.linalg.norm(points, axis=2), self.height))
        for angles in (self.lines, self.cones):  # apart, because the border of a line is the middle of a cone
            strengths = [(2.0**-k, *pair) for k, pair in enumerate(angles)]  # so that two errors do not cancel
            spots = [SpotLight((0, self.height, 0), (0, 0, 0), *values) for values in strengths]
            scene = SceneData(mesh_of([square(self.half)], [FLOOR]), lights=spots)
            renderer = path_renderer(scene, from_above(self.size, self.half, 0.5))
            image, _, nan = rendered(renderer, "explicit", 1)
            sure, truth = np.ones(theta.shape, bool), np.zeros(theta.shape)
            for intensity, cutoff, falloff in strengths:
                share = np.clip((cutoff - theta) / max(cutoff - falloff, 1e-300), 0, 1)
                truth += ALBEDO / np.pi * intensity * share * self.height / r**3
                sure &= np.abs(theta - cutoff) > self.near
            found.add(sure & ~(np.abs(image[..., 0] - truth) <= 1e-5), nan)


SURFACES = (Microfacets, RoughLayers, DegenerateCoordinates, LightInside, SpotAngles)
