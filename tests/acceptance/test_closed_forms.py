"""Light whose value is known: furnaces, one point, a sun, Lambert's lamp, mirrors, glass."""

import numpy as np
import pytest
from oracles import lamps, light

import taichi_tracer as tt

SQUARE = [[0, 1, 2], [0, 2, 3]]
FLOOR = np.array([[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [9, 0, -9]], float)
ABOVE = {"eye": (0, 2, 0), "at": (0, 0, 0), "up": (0, 0, 1), "fov": 60}
GRAY = (0.5, 0.5, 0.5)
FEW = {"intersector": "brute_force", "triangle_test": "moller_trumbore"}  # of a few triangles: small kernels
# A mean of n samples is compared with its value at 4 standard deviations, found from the pixels themselves: a right
# package with other random numbers fails with a probability below 1e-4.
DEVIATIONS = 4.0


def shown(scene, renderer=tt.A2Renderer, estimator="mis", spp=16, view=None, size=(16, 16), **options):
    """The picture, and the points of a flat floor that its pixels show."""
    made = renderer(scene_data=scene, width=size[0], height=size[1], seed=3, jitter=False)
    for name, value in options.items():
        setattr(made, name, value)
    made.camera.set_camera_parameters(**(view or ABOVE))
    return np.asarray(made.use(estimator).render(spp).image()), made.aov("position")


def floor(material=None, **options):
    """A large square that faces up."""
    return tt.scene_from_mesh(FLOOR, SQUARE, material=material or tt.Material(Kd=GRAY), **FEW, **options)


def is_mean(values, right) -> bool:
    """Whether independent values have the mean."""
    return abs(values.mean() - right) < DEVIATIONS * values.std(ddof=1) / np.sqrt(values.size) + 1e-6


def test_a_diffuse_surface_in_a_white_furnace():
    image, _ = shown(floor(environment="white"), estimator="brdf")
    assert np.allclose(image, 0.5, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("estimator", ["uniform", "hemisphere", "environment"])
def test_every_way_to_sample_has_the_mean_of_the_furnace(estimator):
    image, _ = shown(floor(environment="white"), estimator=estimator, spp=64)
    assert is_mean(image[..., 0], 0.5)


@pytest.mark.slow
def test_a_glossy_surface_reflects_what_the_integral_of_its_lobe_says():
    material = tt.Material(Kd=GRAY, Ns=20)
    image, points = shown(floor(material, environment="white"), spp=64, estimator="brdf")
    cosine = 2 / np.linalg.norm(points - [0, 2, 0], axis=-1)
    right = 0.5 * light.phong_albedo(cosine.ravel(), 20).reshape(cosine.shape)
    assert is_mean(image[..., 0] - right, 0)
    assert right.max() - right.min() > 0.003
    assert right.max() == pytest.approx(0.5 * 21 / 22, rel=2e-3)


@pytest.mark.parametrize("path", ["implicit", pytest.param("path", marks=pytest.mark.slow)])
def test_a_closed_room_is_a_geometric_sum(path):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [(0, 4, 5, 1), (2, 3, 7, 6), (0, 1, 3, 2), (4, 6, 7, 5), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    material = tt.Material(Kd=GRAY, Ke=(1, 1, 1))
    room = tt.scene_from_mesh(corners, faces, material=material, environment="black", two_sided_lamps=True, **FEW)
    view = {"eye": (0, 0, 0), "at": (0, 0.2, 1), "up": (0, 1, 0), "fov": 60}
    for bounces in (0, 1, 3):
        image, _ = shown(room, tt.A4Renderer, path, view=view, spp=64, max_bounces=bounces)
        right = lamps.room_radiance(1, 0.5, bounces)
        assert is_mean(image[..., 0], right) if path == "path" else np.allclose(image, right, rtol=1e-4)


KINDS = ["point", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("spot", "directional"))]


@pytest.mark.parametrize("kind", KINDS)
def test_lights_without_size_above_a_plane(kind):
    point = tt.PointLight(position=(0.5, 2, 0), intensity=3)
    spot = tt.SpotLight(position=(0.5, 2, 0), target=(0.5, 0, 0), intensity=3, cutoff=30, falloff=10)
    sun = tt.DirectionalLight(direction=(-1, -1, 0), irradiance=3)
    scene = floor(environment="black", lights=[{"point": point, "spot": spot, "directional": sun}[kind]])
    image, points = shown(scene, spp=1)
    to = np.array([0.5, 2, 0]) - points
    r = np.linalg.norm(to, axis=-1)
    cosine = to[..., 1] / r
    share = np.clip((30 - np.degrees(np.arccos(cosine))) / 20, 0, 1) if kind == "spot" else 1
    right = 0.5 / np.pi * (3 * np.sqrt(0.5) if kind == "directional" else 3 * share * cosine / r**2)
    assert np.allclose(image[..., 1], right, rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("estimator", ["mis", pytest.param("environment", marks=pytest.mark.slow)])
def test_a_square_lamp_lights_a_plane_as_lambert_said(estimator):
    lamp = np.array([[-1, 3, -1], [1, 3, -1], [1, 3, 1], [-1, 3, 1]], float)
    mesh = tt.Mesh(np.vstack([FLOOR, lamp]), np.array([*SQUARE, *(np.array(SQUARE) + 4)]))
    mesh.materials = [tt.Material(Kd=GRAY), tt.Material(Kd=(0, 0, 0), Ke=(0, 4, 6))]  # a channel may be dark
    mesh.face_materials = np.array([0, 0, 1, 1])
    image, points = shown(tt.SceneData(mesh, environment="black", **FEW), tt.A3Renderer, estimator, 64, size=(8, 8))
    up = np.array([0.0, 1, 0])
    right = np.reshape([lamps.polygon_irradiance(x, up, lamp) for x in points.reshape(-1, 3)], (8, 8))
    assert not image[..., 0].any()
    for channel, emitted in ((1, 4), (2, 6)):
        assert is_mean(image[..., channel] - 0.5 / np.pi * emitted * right, 0)
        assert np.allclose(image[..., channel], 0.5 / np.pi * emitted * right, rtol=0.2)


def test_the_exponent_of_a_mirror_shows_the_mirrored_sky():
    sky = np.random.default_rng(2).uniform(0.5, 2, (4, 8, 3))
    material = tt.Material(Kd=GRAY, Ns=1e21)
    image, points = shown(floor(material, environment=sky), estimator="brdf", spp=1)
    away = points - [0, 2, 0]
    away /= np.linalg.norm(away, axis=-1, keepdims=True)
    right = 0.5 * -away[..., 1:2] * light.lookup(sky, (away * [1, -1, 1]).reshape(-1, 3)).reshape(image.shape)
    assert (abs(image - right).max(-1) < 1e-4).mean() > 0.95  # beside an edge of a texel, its neighbour may be seen


def test_glass_reflects_what_fresnel_says():
    """The sky is white above the horizon and black below: what is reflected is seen, and what is refracted is not."""
    sky = np.concatenate([np.ones((4, 8, 3)), np.zeros((4, 8, 3))])
    material = tt.Material(Kd=(0, 0, 0), Ks=(1, 1, 1), d=0.0, Ni=1.5, extra={"illum": (7,)})
    view = {"eye": (0, 2, -4), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 20}
    image, points = shown(floor(material, environment=sky), tt.A4Renderer, "implicit", 256, view)
    to = np.array([0, 2, -4]) - points
    cos_o = to[..., 1] / np.linalg.norm(to, axis=-1)
    cos_t = np.sqrt(1 - (1 - cos_o**2) / 1.5**2)
    parallel, across = (1.5 * cos_o - cos_t) / (1.5 * cos_o + cos_t), (cos_o - 1.5 * cos_t) / (cos_o + 1.5 * cos_t)
    assert is_mean(image[..., 0] - (parallel**2 + across**2) / 2, 0)
    assert 0.05 < image.mean() < 0.2
