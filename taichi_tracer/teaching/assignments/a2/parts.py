"""What is checked in assignment 2: jitter, the running mean, the environment, directions, densities, direct light."""

from functools import partial

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.contracts.lab import bound
from taichi_tracer.teaching import fixtures
from taichi_tracer.teaching.base import Arrays, Numbers, Samples, length_of, method, optional, picture, statistics
from taichi_tracer.teaching.fixtures import rows, samples

JITTER, MEAN, SKY = "anti-aliasing", "Monte Carlo means", "environment light"
DIRECTIONS, REFLECTION, LIGHT, MICROFACETS = "sampling directions", "BRDFs", "direct light", "microfacets"
SAMPLES = 4096  # of each input; the nearest known mistake is 29 standard errors from the solution, and 6 pass

# ── eye rays ──


def pixels(rng: np.random.Generator) -> Arrays:
    """Sixteen pixels of a picture that is not square, and a camera."""
    size = fixtures.picture_size(rng)
    pixel = np.stack([rng.integers(0, size["width"], 16), rng.integers(0, size["height"], 16)], axis=1)
    view = {name: array[0] for name, array in fixtures.views(rng, 1).items()}
    return {"pixel": pixel.astype(np.int32), **size, **view}


@ti.func
def ndc(camera: ti.template(), jitter: ti.template(), pixel):
    """The centre of a pixel, or a random point of it."""
    return camera.generate_ndc_coords(pixel.x, pixel.y, jitter)


def run_ndc(camera_class: type, inputs: Arrays) -> Arrays:
    """The centre of each pixel, and random points of it, in widths and heights of a pixel from its centre."""
    camera = fixtures.camera_of(camera_class, inputs)
    found = samples(bound(ndc, camera, False), inputs, ["pixel"], {"centre": 2}, 1)["centre"][:, 0]
    points = samples(bound(ndc, camera, True), inputs, ["pixel"], {"point": 2}, SAMPLES)["point"]
    size = np.array([inputs["width"], inputs["height"]])
    middle = 2 * (inputs["pixel"] + 0.5) / size - 1
    return {"centre": found, "jitter": statistics((points - middle[:, None]) * size / 2)}


@ti.func
def eye_ray(camera: ti.template(), jitter: ti.template(), pixel):
    """The ray through the centre of a pixel, or through a random point of it."""
    ray = camera.generate_ray(pixel.x, pixel.y, jitter)
    return ray.origin, ray.direction


def run_ray(camera_class: type, inputs: Arrays) -> Arrays:
    """The ray through the centre of each pixel, and how far random rays turn from it, in a thousandth of a radian."""
    camera, width = fixtures.camera_of(camera_class, inputs), {"origin": 3, "direction": 3}
    found = samples(bound(eye_ray, camera, False), inputs, ["pixel"], width, 1)
    jittered = samples(bound(eye_ray, camera, True), inputs, ["pixel"], width, SAMPLES)["direction"]
    origin, direction = found["origin"][:, 0], found["direction"][:, 0]
    return {"origin": origin, "direction": direction, "jitter": statistics(1000 * (jittered - direction[:, None]))}


# ── the running mean ──


def means(rng: np.random.Generator) -> Arrays:
    """Means of 0 to 99 samples, and the next sample."""
    count = np.concatenate([np.zeros(10), rng.integers(1, 100, 90)])
    return {
        "mean": rng.uniform(0, 2, (100, 3)).astype(np.float32),
        "sample": rng.uniform(0, 2, (100, 3)).astype(np.float32),
        "count": count.astype(np.int32),
    }


# ── the environment ──

ROWS, COLUMNS = 8, 16


def sky(rng: np.random.Generator) -> Arrays:
    """Directions through the middle of texels, and four in which rounding leaves the range of asin or of the texels.

    The first and the last column are the same, so that u = 1 may lead to either.
    """
    image = rng.uniform(0, 4, (ROWS, COLUMNS, 3)).astype(np.float32)
    image[:, -1] = image[:, 0]
    image[0], image[-1] = image[0, 0], image[-1, 0]
    u = (rng.integers(0, COLUMNS, 200) + rng.uniform(0.1, 0.9, 200)) / COLUMNS
    v = (rng.integers(0, ROWS, 200) + rng.uniform(0.1, 0.9, 200)) / ROWS
    azimuth, height = 2 * np.pi * (u - 0.5), np.pi * (v - 0.5)
    direction = [np.cos(height) * np.cos(azimuth), np.sin(height), np.cos(height) * np.sin(azimuth)]
    special = [[0, 1.0000001, 0], [0, -1.0000001, 0], [0, -1, 0], [-1, 0.02, 0]]
    return {"direction": np.concatenate([np.stack(direction, axis=1), special]).astype(np.float32), "image": image}


def environment_of(environment_class: type, inputs: Arrays):
    """The environment with the "image" of the inputs, whose texels can be read anywhere."""
    environment = environment_class(inputs["image"])
    environment.texels = fixtures.Guarded(environment.texels)
    return environment


@ti.func
def radiance(environment: ti.template(), direction):
    """The radiance from a direction."""
    return environment.query_ray(tt.Ray(origin=tm.vec3(0), direction=direction))


# ── directions uniform on the sphere ──


def repeats(rng: np.random.Generator) -> Arrays:
    """Eight sets of samples."""
    return {"set": np.arange(8) + rng.integers(0, 1000) * 8}


def run_uniform(sampler_class: type, inputs: Arrays) -> Arrays:
    """Samples of each set."""
    first, direct = int(inputs["set"][0]), fixtures.bare(sampler_class).sample_direction
    found = samples(direct, {}, [], {"direction": 3}, 4 * SAMPLES, range(first, first + len(inputs["set"])))
    return {"direction": statistics(found["direction"]), "length": length_of(found["direction"])}


def run_uniform_pdf(sampler_class: type, inputs: Arrays) -> Arrays:
    """The density, the same for every direction."""
    density = fixtures.bare(sampler_class).evaluate_probability
    return rows(density, {}, [], {"probability": 1}, range(len(inputs["set"])))


# ── the BRDF ──


def surfaces(rng: np.random.Generator, count: int) -> Arrays:
    """Surfaces with their materials and directions to the viewer: every third is diffuse.

    Four diffuse ones have normals along the axes, where a frame that is built carelessly does not exist.
    """
    normal = fixtures.directions(rng, count)
    normal[[0, 3, 6, 9]] = [[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, -1, 0]]
    w_o = fixtures.unit(normal + 0.9 * fixtures.directions(rng, count))
    is_diffuse, Ns = np.arange(count) % 3 == 0, np.ones(count)
    Ns[~is_diffuse] = np.exp(np.linspace(np.log(1.5), np.log(120), count - is_diffuse.sum()) + rng.uniform(0, 0.2))
    f32 = np.float32
    Kd = rng.uniform(0.1, 1, (count, 3)).astype(f32)
    return {"Kd": Kd, "Ns": Ns.astype(f32), "normal": normal.astype(f32), "w_o": w_o.astype(f32)}


@ti.func
def drawn_direction(brdf: ti.template(), material: ti.template(), a, b, w_o, normal):
    """A direction that is drawn on a surface, whose material is made of two numbers."""
    return brdf.sample_direction(material(a, b), w_o, normal)


@ti.func
def value(given: ti.template(), a, b, w_o, w_i, normal):
    """What a method has for two directions; given are the method, and what makes a material of two numbers."""
    return given[0](given[1](a, b), w_o, w_i, normal)


def run_drawn(material, names):
    """A function that draws directions on each surface.

    Args:
        material: a ``ti.func`` of two numbers of a surface. names: of these among the inputs.
    """

    def run(brdf_class: type, inputs: Arrays) -> Arrays:
        w_i = bound(drawn_direction, fixtures.bare(brdf_class), material)
        drawn = samples(w_i, inputs, [*names, "w_o", "normal"], {"w_i": 3}, SAMPLES)["w_i"]
        return {"w_i": statistics(drawn), "length": length_of(drawn)}

    return run


def run_values(material, names, method_name: str, answer: str, width: int):
    """A function that evaluates a method for all pairs of directions; see ``run_drawn``."""

    def given(brdf_class: type, _inputs: Arrays):
        return getattr(fixtures.bare(brdf_class), method_name), material

    return fixtures.on_rows(value, [*names, "w_o", "w_i", "normal"], {answer: width}, given)


def pairs_of_directions(rng: np.random.Generator) -> Arrays:
    """Surfaces with directions to the light, half of them near the middle of the lobe; some below the horizon.

    A diffuse material is only asked for directions above the horizon, where f_r is Kd/π without any doubt.
    """
    found = surfaces(rng, 300)
    n, w_o = found["normal"].astype(np.float64), found["w_o"].astype(np.float64)
    w_r = 2 * (n * w_o).sum(axis=1, keepdims=True) * n - w_o
    near = fixtures.unit(w_r + rng.uniform(0, 0.6, (300, 1)) * fixtures.directions(rng, 300))
    w_i = np.where(rng.random((300, 1)) < 0.6, near, fixtures.directions(rng, 300))
    is_below = (n * w_i).sum(axis=1) < 0.02
    flipped = fixtures.unit(w_i - 2 * (n * w_i).sum(axis=1, keepdims=True) * n + 0.1 * n)
    w_i = np.where((is_below & (found["Ns"] == 1))[:, None], flipped, w_i)
    return {**found, "w_i": w_i.astype(np.float32)}


def any_pairs_of_directions(rng: np.random.Generator) -> Arrays:
    """Pairs as above, but diffuse materials are asked for directions below the horizon, too: their density is 0."""
    found = pairs_of_directions(rng)
    found["w_i"] = np.where((np.arange(300) % 6 == 0)[:, None], -found["w_i"], found["w_i"])
    return found


# ── microfacets, which are optional ──


def rough_surfaces(rng: np.random.Generator, count: int) -> Arrays:
    """Rough metals. Both roughnesses of each are the same, so that every frame about the normal gives the same."""
    found, f32 = surfaces(rng, count), np.float32
    w_o = fixtures.unit(found["normal"] + 0.97 * fixtures.directions(rng, count))
    alpha, F0 = np.exp(rng.uniform(np.log(0.1), np.log(0.9), count)), rng.uniform(0.1, 0.9, (count, 3))
    return {"alpha": alpha.astype(f32), "F0": F0.astype(f32), "normal": found["normal"], "w_o": w_o.astype(f32)}


def rough_pairs(rng: np.random.Generator) -> Arrays:
    """Rough metals with directions to the light, all of them above the horizon and near the middle of the lobe."""
    found = rough_surfaces(rng, 300)
    n, w_o = found["normal"].astype(np.float64), found["w_o"].astype(np.float64)
    w_r = 2 * (n * w_o).sum(axis=1, keepdims=True) * n - w_o
    w_i = fixtures.unit(w_r + rng.uniform(0, 0.6, (300, 1)) * fixtures.directions(rng, 300))
    cosine = (n * w_i).sum(axis=1, keepdims=True)
    w_i = fixtures.unit(w_i + np.maximum(0.15 - cosine, 0) * n)
    return {**found, "w_i": w_i.astype(np.float32)}


# ── one sample of the direct light ──

RAYS, LIGHT_SAMPLES = 12, 1024  # the nearest known mistake is 13 standard errors from the solution


def lit_scene(rng: np.random.Generator) -> Arrays:
    """A floor, a wall, a roof that casts a shadow and a low one, with two materials, under a sky; and rays at them.

    Whoever begins shadow rays far from the surface begins some of them above the low roof.
    """
    square = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], np.float64)
    floor = 3 * square
    wall = square[:, [0, 2, 1]] * [2, 2, 1] + [0, 1, -2]
    roof, low = 0.6 * square + [0.4, 1.2, 0.3], 0.4 * square + [-1.9, 0.15, 0.6]
    vertices = np.concatenate([floor, wall, roof, low])
    image = rng.uniform(0.2, 2, (4, 8, 3)).astype(np.float32)
    target = np.concatenate(
        [rng.uniform([-1.5, 0, -1], [1.5, 0, 1], (5, 3)), rng.uniform([-1, 0.5, -2], [1, 1.5, -2], (3, 3))]
    )
    eye = np.array([0.2, 1.5, 5.0])
    below = rng.uniform([-2.1, 0, 0.7], [-1.7, 0, 0.8], (2, 3))
    direction = fixtures.unit(np.concatenate([target - eye, [[0.3, 1, -1], [-1, 0.4, 1]], below - eye]))
    lit = {
        "origin": np.tile(eye, (RAYS, 1)).astype(np.float32),
        "direction": direction.astype(np.float32),
        "vertices": vertices,
        "faces": fixtures.quads(4),
        "materials": np.array([0, 0, 1, 1, 0, 0, 0, 0], np.int32),
        "Kd": rng.uniform(0.3, 0.9, (2, 3)),
        "Ns": np.array([1.0, rng.uniform(4, 12)]),
        "image": image,
    }
    return fixtures.turned(rng, lit)


# ── a picture ──


def spheres_view(rng: np.random.Generator) -> Arrays:
    """A camera in front of the spheres, and a sky."""
    return {**fixtures.front_view(rng), "image": rng.uniform(0.2, 2, (8, 16, 3)).astype(np.float32)}


def run_picture(classes, inputs: Arrays) -> Arrays:
    """The spheres, with all of the student's classes."""
    environment = environment_of(classes.Environment, inputs)
    scene = tt.load_scene_data("specular_spheres", environment=environment)
    camera = classes.Camera(fixtures.SIZE, fixtures.SIZE, **fixtures.view_of(inputs))
    return fixtures.noisy_picture(classes.A2Renderer(scene, camera=camera).use("brdf"), first_seed=0)


LENGTH = ("length",)
BOTH = fixtures.run_integrators(("uniform", "brdf"), LIGHT_SAMPLES)
PIXELS, RAYS_OF_PIXELS = Samples(("centre",), "pixels"), Samples(("origin", "direction"), "pixels")
DIRECTION = Numbers(2e-3, called="directions")
COURSE, ROUGH = (fixtures.material_of, ("Kd", "Ns")), (fixtures.rough_material_of, ("alpha", "F0"))
VALUES = (
    ("evaluate_probability", "probability", 1),
    ("evaluate_brdf", "f_r", 3),
    ("evaluate_brdf_factor", "factor", 3),
)
PDF, F_R, FACTOR = (run_values(*COURSE, *value) for value in VALUES)
M_PDF, M_F_R, M_FACTOR = (run_values(*ROUGH, *value) for value in VALUES)
FEW, FEW_ROUGH = partial(surfaces, count=12), partial(rough_surfaces, count=12)
SAME_FACTOR, DRAWN = Numbers(1e-4, called="directions"), Samples(exact=LENGTH, called="surfaces")
RUN_SKY = fixtures.on_rows(radiance, ["direction"], {"radiance": 3}, environment_of)
NEXT_MEAN = fixtures.on_rows("running_mean", ["mean", "sample", "count"], {"new mean": 3})
PARTS = (
    method("Camera.generate_ndc_coords", 3, JITTER, pixels, run_ndc, PIXELS),
    method("Camera.generate_ray", 2, JITTER, pixels, run_ray, RAYS_OF_PIXELS),
    method("A2Renderer.running_mean", 3, MEAN, means, NEXT_MEAN, Numbers(1e-4, called="means")),
    method("Environment.query_ray", 4, SKY, sky, RUN_SKY, Numbers(1e-4, called="directions")),
    method("UniformSampler.sample_direction", 2, DIRECTIONS, repeats, run_uniform, Samples(exact=LENGTH)),
    method("UniformSampler.evaluate_probability", 1, DIRECTIONS, repeats, run_uniform_pdf, Numbers(1e-5)),
    method("BRDF.sample_direction", 4, DIRECTIONS, FEW, run_drawn(*COURSE), DRAWN),
    method("BRDF.evaluate_probability", 2, DIRECTIONS, any_pairs_of_directions, PDF, DIRECTION),
    method("BRDF.evaluate_brdf", 2, REFLECTION, pairs_of_directions, F_R, DIRECTION),
    method("BRDF.evaluate_brdf_factor", 2, REFLECTION, pairs_of_directions, FACTOR, SAME_FACTOR),
    method("A2Renderer.shade_ray", 5, LIGHT, lit_scene, BOTH, Samples(called="rays")),
    optional(method("MicrofacetBRDF.sample_direction", 4, MICROFACETS, FEW_ROUGH, run_drawn(*ROUGH), DRAWN)),
    optional(method("MicrofacetBRDF.evaluate_probability", 2, MICROFACETS, rough_pairs, M_PDF, DIRECTION)),
    optional(method("MicrofacetBRDF.evaluate_brdf", 2, MICROFACETS, rough_pairs, M_F_R, DIRECTION)),
    optional(method("MicrofacetBRDF.evaluate_brdf_factor", 2, MICROFACETS, rough_pairs, M_FACTOR, DIRECTION)),
    picture("brdf", 2, spheres_view, run_picture),
)
