"""What is checked in assignment 2: jitter, the running mean, the environment, directions, densities, direct light."""

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.ray import Ray
from taichi_tracer.teaching import stand_ins
from taichi_tracer.teaching.base import Arrays, Part
from taichi_tracer.teaching.judges import Numbers, Pictures, Samples, statistics
from taichi_tracer.teaching.stand_ins import material_of, vector, write, write_sample

JITTER, MEAN, SKY = "anti-aliasing", "Monte Carlo means", "environment light"
DIRECTIONS, REFLECTION, LIGHT = "sampling directions", "BRDFs", "direct light"
SAMPLES = 4096  # of each input
SEED = 5  # of the random numbers of the parts; the inputs have a seed of their own

# ── eye rays ──


def pixels(rng: np.random.Generator) -> Arrays:
    """Sixteen pixels of a picture that is not square, and a camera."""
    size = stand_ins.picture_size(rng)
    pixel = np.stack([rng.integers(0, size["width"], 16), rng.integers(0, size["height"], 16)], axis=1)
    view = {name: array[0] for name, array in stand_ins.views(rng, 1).items()}
    return {"pixel": pixel.astype(np.int32), **size, **view}


@ti.kernel
def ndc_kernel(
    camera: ti.template(),
    sampler: ti.template(),
    pixel: ti.types.ndarray(ndim=2),
    centre: ti.types.ndarray(ndim=2),
    jittered: ti.types.ndarray(ndim=3),
):
    """The point of each pixel in NDC."""
    for i in range(pixel.shape[0]):
        sampler.start(SEED, i, 0, 0)
        p = camera.generate_ndc_coords(pixel[i, 0], pixel[i, 1], False)
        centre[i, 0], centre[i, 1] = p.x, p.y
    for i, j in ti.ndrange(pixel.shape[0], jittered.shape[1]):
        sampler.start(SEED, i, 0, j)
        p = camera.generate_ndc_coords(pixel[i, 0], pixel[i, 1], True)
        jittered[i, j, 0], jittered[i, j, 1] = p.x, p.y


def run_ndc(camera_class: type, inputs: Arrays) -> Arrays:
    """The centre of each pixel, and random points of it, in widths and heights of a pixel from its centre."""
    count = len(inputs["pixel"])
    centre, jittered = np.zeros((count, 2), np.float32), np.zeros((count, SAMPLES, 2), np.float32)
    camera = stand_ins.camera(camera_class, inputs["width"], inputs["height"])
    ndc_kernel(camera, stand_ins.sampler(count), inputs["pixel"], centre, jittered)
    size = np.array([inputs["width"], inputs["height"]])
    middle = 2 * (inputs["pixel"] + 0.5) / size - 1
    return {"centre": centre, "jitter": statistics((jittered - middle[:, None]) * size / 2)}


@ti.kernel
def ray_kernel(
    camera: ti.template(),
    sampler: ti.template(),
    pixel: ti.types.ndarray(ndim=2),
    origin: ti.types.ndarray(ndim=2),
    centre: ti.types.ndarray(ndim=2),
    jittered: ti.types.ndarray(ndim=3),
):
    """The ray of each pixel."""
    for i in range(pixel.shape[0]):
        sampler.start(SEED, i, 0, 0)
        ray = camera.generate_ray(pixel[i, 0], pixel[i, 1], False)
        write(origin, i, ray.origin)
        write(centre, i, ray.direction)
    for i, j in ti.ndrange(pixel.shape[0], jittered.shape[1]):
        sampler.start(SEED, i, 0, j)
        write_sample(jittered, i, j, camera.generate_ray(pixel[i, 0], pixel[i, 1], True).direction)


def run_ray(camera_class: type, inputs: Arrays) -> Arrays:
    """The ray through the centre of each pixel, and how far random rays turn from it, in a thousandth of a radian."""
    count = len(inputs["pixel"])
    origin, centre = (np.zeros((count, 3), np.float32) for _ in range(2))
    jittered = np.zeros((count, SAMPLES, 3), np.float32)
    view = {name: inputs[name].tolist() for name in ("eye", "at", "up", "fov")}
    camera = stand_ins.camera(camera_class, inputs["width"], inputs["height"], **view)
    ray_kernel(camera, stand_ins.sampler(count), inputs["pixel"], origin, centre, jittered)
    return {"origin": origin, "direction": centre, "jitter": statistics(1000 * (jittered - centre[:, None]))}


# ── the running mean ──


def means(rng: np.random.Generator) -> Arrays:
    """Means of 0 to 99 samples, and the next sample."""
    count = np.concatenate([np.zeros(10), rng.integers(1, 100, 90)])
    return {
        "mean": rng.uniform(0, 2, (100, 3)).astype(np.float32),
        "sample": rng.uniform(0, 2, (100, 3)).astype(np.float32),
        "count": count.astype(np.int32),
    }


@ti.kernel
def mean_kernel(
    renderer: ti.template(),
    mean: ti.types.ndarray(ndim=2),
    sample: ti.types.ndarray(ndim=2),
    count: ti.types.ndarray(ndim=1),
    new: ti.types.ndarray(ndim=2),
):
    """The new mean of each row."""
    for i in range(mean.shape[0]):
        write(new, i, renderer.running_mean(vector(mean, i), vector(sample, i), count[i]))


def run_mean(renderer_class: type, inputs: Arrays) -> Arrays:
    """The mean with the next sample."""
    new = np.zeros(inputs["mean"].shape, np.float32)
    mean_kernel(stand_ins.of(renderer_class), inputs["mean"], inputs["sample"], inputs["count"], new)
    return {"new mean": new}


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


@ti.kernel
def sky_kernel(environment: ti.template(), direction: ti.types.ndarray(ndim=2), radiance: ti.types.ndarray(ndim=2)):
    """The radiance from each direction."""
    for i in range(direction.shape[0]):
        write(radiance, i, environment.query_ray(Ray(origin=tm.vec3(0), direction=vector(direction, i))))


def run_sky(environment_class: type, inputs: Arrays) -> Arrays:
    """The radiance from each direction."""
    radiance = np.zeros(inputs["direction"].shape, np.float32)
    environment = environment_class(inputs["image"])
    environment.texels = stand_ins.Guarded(environment.texels)
    sky_kernel(environment, inputs["direction"], radiance)
    environment.destroy()
    return {"radiance": radiance}


# ── directions uniform on the sphere ──


def repeats(rng: np.random.Generator) -> Arrays:
    """Eight sets of samples."""
    return {"set": np.arange(8) + rng.integers(0, 1000) * 8}


@ti.kernel
def uniform_kernel(directions: ti.template(), sampler: ti.template(), first: ti.i32, samples: ti.types.ndarray(ndim=3)):
    """Random directions."""
    for i, j in ti.ndrange(samples.shape[0], samples.shape[1]):
        sampler.start(SEED, first + i, 0, j)
        write_sample(samples, i, j, directions.sample_direction())


def run_uniform(sampler_class: type, inputs: Arrays) -> Arrays:
    """Samples of each set."""
    samples = np.zeros((len(inputs["set"]), 4 * SAMPLES, 3), np.float32)
    uniform_kernel(stand_ins.of(sampler_class), stand_ins.sampler(1), int(inputs["set"][0]), samples)
    return {"direction": statistics(samples)}


@ti.kernel
def uniform_pdf_kernel(directions: ti.template(), probability: ti.types.ndarray(ndim=1)):
    """The density, several times."""
    for i in range(probability.shape[0]):
        probability[i] = directions.evaluate_probability()


def run_uniform_pdf(sampler_class: type, inputs: Arrays) -> Arrays:
    """The density, the same for every direction."""
    probability = np.zeros(len(inputs["set"]), np.float32)
    uniform_pdf_kernel(stand_ins.of(sampler_class), probability)
    return {"probability": probability}


# ── the BRDF ──


def surfaces(rng: np.random.Generator, count: int) -> Arrays:
    """Surfaces with their materials and directions to the viewer: every third is diffuse.

    Four diffuse ones have normals along the axes, where a frame that is built carelessly does not exist.
    """
    normal = stand_ins.directions(rng, count)
    normal[[0, 3, 6, 9]] = [[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, -1, 0]]
    w_o = stand_ins.unit(normal + 0.9 * stand_ins.directions(rng, count))
    is_diffuse, Ns = np.arange(count) % 3 == 0, np.ones(count)
    Ns[~is_diffuse] = np.exp(np.linspace(np.log(1.5), np.log(120), count - is_diffuse.sum()) + rng.uniform(0, 0.2))
    f32 = np.float32
    Kd = rng.uniform(0.1, 1, (count, 3)).astype(f32)
    return {"Kd": Kd, "Ns": Ns.astype(f32), "normal": normal.astype(f32), "w_o": w_o.astype(f32)}


def few_surfaces(rng: np.random.Generator) -> Arrays:
    """Twelve surfaces, on each of which many directions are drawn."""
    return surfaces(rng, 12)


@ti.kernel
def brdf_sample_kernel(
    brdf: ti.template(),
    sampler: ti.template(),
    Kd: ti.types.ndarray(ndim=2),
    Ns: ti.types.ndarray(ndim=1),
    normal: ti.types.ndarray(ndim=2),
    w_o: ti.types.ndarray(ndim=2),
    samples: ti.types.ndarray(ndim=3),
):
    """Random directions of each surface."""
    for i, j in ti.ndrange(samples.shape[0], samples.shape[1]):
        sampler.start(SEED, i, 0, j)
        w_i = brdf.sample_direction(material_of(Kd, Ns, i), vector(w_o, i), vector(normal, i))
        write_sample(samples, i, j, w_i)


def run_brdf_sample(brdf_class: type, inputs: Arrays) -> Arrays:
    """Directions on each surface."""
    count = len(inputs["Ns"])
    samples = np.zeros((count, SAMPLES, 3), np.float32)
    arrays = [inputs[name] for name in ("Kd", "Ns", "normal", "w_o")]
    brdf_sample_kernel(stand_ins.of(brdf_class), stand_ins.sampler(count), *arrays, samples)
    return {"w_i": statistics(samples)}


def pairs_of_directions(rng: np.random.Generator) -> Arrays:
    """Surfaces with directions to the light, half of them near the middle of the lobe; some below the horizon.

    A diffuse material is only asked for directions above the horizon, where f_r is Kd/π without any doubt.
    """
    found = surfaces(rng, 300)
    n, w_o = found["normal"].astype(np.float64), found["w_o"].astype(np.float64)
    w_r = 2 * (n * w_o).sum(axis=1, keepdims=True) * n - w_o
    near = stand_ins.unit(w_r + rng.uniform(0, 0.6, (300, 1)) * stand_ins.directions(rng, 300))
    w_i = np.where(rng.random((300, 1)) < 0.6, near, stand_ins.directions(rng, 300))
    is_below = (n * w_i).sum(axis=1) < 0.02
    flipped = stand_ins.unit(w_i - 2 * (n * w_i).sum(axis=1, keepdims=True) * n + 0.1 * n)
    w_i = np.where((is_below & (found["Ns"] == 1))[:, None], flipped, w_i)
    return {**found, "w_i": w_i.astype(np.float32)}


def any_pairs_of_directions(rng: np.random.Generator) -> Arrays:
    """The same, but diffuse materials are asked for directions below the horizon, too: their density is 0."""
    found = pairs_of_directions(rng)
    found["w_i"] = np.where((np.arange(300) % 6 == 0)[:, None], -found["w_i"], found["w_i"])
    return found


@ti.kernel
def brdf_kernel(
    function: ti.template(),
    is_colour: ti.template(),
    Kd: ti.types.ndarray(ndim=2),
    Ns: ti.types.ndarray(ndim=1),
    normal: ti.types.ndarray(ndim=2),
    w_o: ti.types.ndarray(ndim=2),
    w_i: ti.types.ndarray(ndim=2),
    values: ti.types.ndarray(ndim=2),
):
    """A function of the BRDF for each pair of directions."""
    for i in range(Ns.shape[0]):
        value = function(material_of(Kd, Ns, i), vector(w_o, i), vector(w_i, i), vector(normal, i))
        if ti.static(is_colour):
            write(values, i, value)
        else:
            values[i, 0] = value


def run_brdf(method: str, width: int, name: str):
    """A function that evaluates a method of the BRDF for all pairs of directions."""

    def run(brdf_class: type, inputs: Arrays) -> Arrays:
        values = np.zeros((len(inputs["Ns"]), width), np.float32)
        arrays = [inputs[key] for key in ("Kd", "Ns", "normal", "w_o", "w_i")]
        brdf_kernel(getattr(stand_ins.of(brdf_class), method), width == 3, *arrays, values)
        return {name: values}

    return run


# ── one sample of the direct light ──

RAYS, LIGHT_SAMPLES = 10, 1024


def lit_scene(rng: np.random.Generator) -> Arrays:
    """A floor, a wall and a roof that casts a shadow, with two materials, under a sky; and rays at them."""
    square = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], np.float64)
    floor = 3 * square
    wall = square[:, [0, 2, 1]] * [2, 2, 1] + [0, 1, -2]
    roof = 0.6 * square + [0.4, 1.2, 0.3]
    vertices = np.concatenate([floor, wall, roof])
    faces = np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * k for k in range(3)]).astype(np.int32)
    image = rng.uniform(0.2, 2, (4, 8, 3)).astype(np.float32)
    target = np.concatenate(
        [rng.uniform([-1.5, 0, -1], [1.5, 0, 1], (5, 3)), rng.uniform([-1, 0.5, -2], [1, 1.5, -2], (3, 3))]
    )
    eye = np.array([0.2, 1.5, 5.0])
    direction = stand_ins.unit(np.concatenate([target - eye, [[0.3, 1, -1], [-1, 0.4, 1]]]))
    return {
        "origin": np.tile(eye, (RAYS, 1)).astype(np.float32),
        "direction": direction.astype(np.float32),
        "vertices": vertices,
        "faces": faces,
        "materials": np.array([0, 0, 1, 1, 0, 0], np.int32),
        "Kd": rng.uniform(0.3, 0.9, (2, 3)),
        "Ns": np.array([1.0, rng.uniform(4, 12)]),
        "image": image,
    }


def scene_of(inputs: Arrays):
    """The scene of the inputs. It is kept for the next class under test."""
    names = ("vertices", "faces", "materials", "Kd", "Ns", "image")
    return stand_ins.kept("lit scene", make_scene, *(inputs[name] for name in names))


def make_scene(vertices, faces, ids, Kd, Ns, image):
    """A scene from arrays."""
    materials = [tt.Material(f"m{i}", Kd=tuple(Kd[i]), Ns=float(Ns[i])) for i in range(len(Ns))]
    options = {"intersector": stand_ins.PlainIntersector, "fast": False, "environment": image}
    return tt.scene_from_mesh(vertices, faces, material=materials, face_materials=ids, **options)


def run_light(renderer_class: type, inputs: Arrays) -> Arrays:
    """Samples of the light along each ray, by both estimators."""
    scene, found = scene_of(inputs), {}
    for name in ("uniform", "brdf"):
        renderer = renderer_class(scene, 8, 8).use(name)
        samples = stand_ins.light_along(renderer, inputs, LIGHT_SAMPLES)
        found[f"radiance ({name})"] = statistics(samples)
    return found


# ── a picture ──


def spheres_view(rng: np.random.Generator) -> Arrays:
    """A camera in front of the spheres, and a sky."""
    eye = np.array([0, 1, 3]) + rng.uniform(-0.15, 0.15, 3)
    view = {"eye": eye, "at": np.array([0.0, 1, 0]), "up": np.array([0.0, 1, 0]), "fov": np.array(60.0)}
    return {**view, "image": rng.uniform(0.2, 2, (8, 16, 3)).astype(np.float32)}


def run_picture(classes, inputs: Arrays) -> Arrays:
    """The spheres, with all of the student's classes."""
    environment = classes.Environment(inputs["image"])
    environment.texels = stand_ins.Guarded(environment.texels)
    scene = tt.load_scene_data("specular_spheres", environment=environment, fast=False)
    size = stand_ins.SIZE
    camera = classes.Camera(size, size, **{name: inputs[name].tolist() for name in ("eye", "at", "up", "fov")})
    renderer = classes.A2Renderer(scene, camera=camera, fast=False).use("brdf")
    found = stand_ins.noisy_picture(renderer, first_seed=0)
    scene.destroy()
    return found


def samples_of(*exact: str, called: str = "inputs") -> Samples:
    """A judge of random answers, some of which are not random."""
    return Samples(exact, called)


PARTS = (
    Part("Camera.generate_ndc_coords", 3, JITTER, "Camera", pixels, run_ndc, samples_of("centre", called="pixels")),
    Part(
        "Camera.generate_ray",
        2,
        JITTER,
        "Camera",
        pixels,
        run_ray,
        samples_of("origin", "direction", called="pixels"),
    ),
    Part("A2Renderer.running_mean", 3, MEAN, "A2Renderer", means, run_mean, Numbers(1e-4, called="means")),
    Part("Environment.query_ray", 4, SKY, "Environment", sky, run_sky, Numbers(1e-4, called="directions")),
    Part("UniformSampler.sample_direction", 2, DIRECTIONS, "UniformSampler", repeats, run_uniform, samples_of()),
    Part(
        "UniformSampler.evaluate_probability", 1, DIRECTIONS, "UniformSampler", repeats, run_uniform_pdf, Numbers(1e-5)
    ),
    Part("BRDF.sample_direction", 4, DIRECTIONS, "BRDF", few_surfaces, run_brdf_sample, samples_of(called="surfaces")),
    Part(
        "BRDF.evaluate_probability",
        2,
        DIRECTIONS,
        "BRDF",
        any_pairs_of_directions,
        run_brdf("evaluate_probability", 1, "probability"),
        Numbers(2e-3, called="directions"),
    ),
    Part(
        "BRDF.evaluate_brdf",
        2,
        REFLECTION,
        "BRDF",
        pairs_of_directions,
        run_brdf("evaluate_brdf", 3, "f_r"),
        Numbers(2e-3, called="directions"),
    ),
    Part(
        "BRDF.evaluate_brdf_factor",
        2,
        REFLECTION,
        "BRDF",
        pairs_of_directions,
        run_brdf("evaluate_brdf_factor", 3, "factor"),
        Numbers(1e-4, called="directions"),
    ),
    Part("A2Renderer.shade_ray", 5, LIGHT, "A2Renderer", lit_scene, run_light, samples_of(called="rays")),
    Part("picture: brdf", 2, "the whole pipeline", "", spheres_view, run_picture, Pictures()),
)
