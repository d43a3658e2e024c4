"""What is checked in assignment 3: points on lights, densities of two measures, MIS, environments by their light."""

import numpy as np
import taichi as ti

from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.teaching import fixtures
from taichi_tracer.teaching.base import Arrays, Numbers, Samples, length_of, method, optional, picture, statistics
from taichi_tracer.teaching.fixtures import WHOLE, rows, samples
from taichi_tracer.teaching.running import own_method

POINTS, MEASURES, COMBINED = "sampling lights", "densities per area and per solid angle", "multiple importance sampling"
SKY = "environments by their light"
# With so many samples, the nearest known mistakes are 12 and 10 standard errors from the solution, and 6 pass.
SAMPLES, LIGHT_SAMPLES = 8192, 4096
TRIANGLES = 5

# ── triangles that emit ──


def triangles(rng: np.random.Generator) -> Arrays:
    """100 triangles."""
    return {name: rng.uniform(-2, 2, (100, 3)).astype(np.float32) for name in ("v0", "v1", "v2")}


def lights(rng: np.random.Generator) -> Arrays:
    """Five emissive triangles of different size among nine, and four points that they light."""
    size = np.exp(rng.uniform(np.log(0.3), np.log(1.5), 9))[:, None, None]
    corners = rng.uniform(-1, 1, (9, 3, 3)) * size + rng.uniform(-2, 2, (9, 1, 3))
    return {
        "vertices": corners.reshape(-1, 3),
        "faces": np.arange(27, dtype=np.int32).reshape(9, 3),
        "normals": np.tile([0.0, 1, 0], (27, 1)),
        "material_ids": np.zeros(9, np.int32),
        "emissive": np.sort(rng.permutation(9)[:TRIANGLES]).astype(np.int32),
        "hit_point": (rng.uniform(-1, 1, (4, 3)) + [0, 6, 0]).astype(np.float32),
    }


def light_sampler(sampler_class: type, inputs: Arrays, has_cdf: bool = True):
    """An object of the class under test whose tables are filled in."""
    corners = inputs["vertices"].reshape(-1, 3, 3)[inputs["emissive"]]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    fields = fixtures.cached("lights", make_fields, inputs["emissive"], areas.astype(np.float32))
    cdf = np.cumsum(areas) / areas.sum() if has_cdf else np.zeros(TRIANGLES)
    fields["cdf"].from_numpy(cdf.astype(np.float32))
    made = fixtures.bare(sampler_class, n_emissive_triangles=TRIANGLES, total_area=float(areas.sum()), **fields)
    made.geometry = fixtures.geometry(inputs)
    return made


def make_fields(ids: np.ndarray, areas: np.ndarray) -> dict:
    """The fields of a sampler of lights."""
    kinds = {"areas": float, "cdf": float, "emissive_triangle_ids": ti.i32}
    found = {name: ti.field(kind, len(ids)) for name, kind in kinds.items()}
    found["areas"].from_numpy(areas)
    found["emissive_triangle_ids"].from_numpy(ids)
    return found


def run_cdf(sampler_class: type, inputs: Arrays) -> Arrays:
    """The cumulative distribution."""
    made = light_sampler(sampler_class, inputs, has_cdf=False)
    made.compute_cdf()
    return {"cdf": made.cdf.to_numpy()}


def run_choice(sampler_class: type, inputs: Arrays) -> Arrays:
    """How often each triangle is chosen, in four sets of samples."""
    made = light_sampler(sampler_class, inputs)
    chosen = samples(made.sample_emissive_triangle, {}, [], {"chosen": WHOLE}, SAMPLES, range(4))["chosen"]
    return {"chosen": statistics(chosen[..., None] == np.arange(TRIANGLES))}


def run_density(sampler_class: type, inputs: Arrays) -> Arrays:
    """The density of the points; it is the same for all of them."""
    return rows(light_sampler(sampler_class, inputs).evaluate_probability, {}, [], {"density": 1}, range(1))


def run_points(sampler_class: type, inputs: Arrays) -> Arrays:
    """Directions to the lights from each point, and how often each triangle is chosen."""
    made = light_sampler(sampler_class, inputs)
    found = samples(made.sample_mesh_lights, inputs, ["hit_point"], {"w_i": 3, "chosen": WHOLE}, SAMPLES)
    w_i, chosen = found["w_i"], found["chosen"]
    return {
        "w_i": statistics(w_i),
        "triangle_id": statistics(chosen[..., None] == inputs["emissive"]),
        "place (u, v)": statistics(places_on_triangles(inputs, w_i.astype(np.float64), chosen)),
        "length": length_of(w_i),
    }


def places_on_triangles(inputs: Arrays, w_i: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """(n, m, 2) barycentric coordinates (u, v) at which each direction meets the plane of its own triangle."""
    corners = inputs["vertices"][inputs["faces"]][np.clip(chosen, 0, len(inputs["faces"]) - 1)]
    _, u, v = fixtures.met_planes(inputs["hit_point"].astype(np.float64)[:, None], w_i, corners)
    return np.clip(np.stack([u, v], axis=-1), -10, 10)


# ── densities and weights ──


def densities(rng: np.random.Generator) -> Arrays:
    """Densities, distances and cosines."""
    names = ("pdf", "other_pdf", "distance", "cos_light")
    low, high = np.array([0.05, 0.05, 0.3, 0.1]), np.array([4.0, 4.0, 5.0, 1.0])
    return dict(zip(names, rng.uniform(low, high, (100, 4)).astype(np.float32).T.copy(), strict=True))


# ── environments ──


def image(rng: np.random.Generator) -> Arrays:
    """A picture with a bright spot."""
    pixels = rng.uniform(0, 1, (8, 16, 3))
    pixels[rng.integers(1, 7), rng.integers(0, 16)] = 40
    return {"image": pixels}


def run_probabilities(sampler_class: type, inputs: Arrays) -> Arrays:
    """The probability of each texel."""
    return {"probability": np.asarray(sampler_class().compute_probabilities(inputs["image"]), np.float64).reshape(-1)}


def probabilities(rng: np.random.Generator) -> Arrays:
    """Probabilities of texels."""
    return {"probabilities": rng.dirichlet(np.ones(128)).reshape(8, 16)}


def run_sky_density(sampler_class: type, inputs: Arrays) -> Arrays:
    """The density in each texel."""
    return {"density": np.asarray(sampler_class().evaluate_density(inputs["probabilities"]), np.float64).reshape(-1)}


# ── points of an environment ──

ROUTE = ("scalar", "marginal_ptheta", "conditional_p_phi_given_theta", "cdfs")  # the steps of the course, in order
ON_EDGE = 1e-5  # of a texel: a point that rounding has put so far below an edge is on it


@ti.kernel
def run_function(function: ti.template()):
    """Call a function of kernels."""
    function()


def call(method) -> None:
    """Call a method, which may be one of Python, a kernel, or a function of kernels."""
    is_of_kernels = getattr(method, "_is_taichi_function", False) and not getattr(method, "is_for_python_too", False)
    if is_of_kernels:
        run_function(method)
    else:
        method()


def scalar_of(environment_class: type, inputs: Arrays) -> np.ndarray:
    """(w, h) what ``precompute_scalar`` writes into ``image_scalar``, divided by the sum."""
    made = environment_class(inputs["image"])
    call(made.precompute_scalar)
    found = made.image_scalar.to_numpy().astype(np.float64)
    made.destroy()
    with np.errstate(all="ignore"):
        return found / found.sum()


def right_scalar(image: np.ndarray) -> np.ndarray:
    """(w, h) the same for an image, from the definition."""
    luminance = (image[::-1] @ [0.2126, 0.7152, 0.0722]).T
    weights = luminance * np.sin(np.pi * (np.arange(len(image)) + 0.5) / len(image))
    return weights / weights.sum()


def run_scalar(environment_class: type, inputs: Arrays) -> Arrays:
    """The share of each texel."""
    return {"share of the sum": scalar_of(environment_class, inputs).reshape(-1)}


@compile_time
def precompute_scalar(_environment):
    """In place of a wrong method; the right numbers are there already."""


def prepared(environment_class: type, inputs: Arrays):
    """An environment whose tables the class under test has filled in, with the right ``image_scalar``."""
    right, own = right_scalar(inputs["image"]), scalar_of(environment_class, inputs)
    if not np.allclose(own, right, rtol=1e-3, atol=1e-7):
        members = {"precompute_scalar": precompute_scalar, "__module__": environment_class.__module__}
        environment_class = type(environment_class.__name__, (environment_class,), members)
    made = environment_class(inputs["image"])
    made.image_scalar.from_numpy(right.astype(np.float32))
    if own_method(environment_class, "precompute_envmap") is not None:
        call(made.precompute_envmap)
    else:
        for step in ROUTE:
            call(getattr(made, f"precompute_{step}"))
    return made


def run_image_points(environment_class: type, inputs: Arrays) -> Arrays:
    """How often each row, each column, and each block of the image is hit, and where within a texel."""
    made = prepared(environment_class, inputs)
    points = samples(made.importance_sample_envmap, {}, [], {"point": 2}, 2 * SAMPLES, range(4))["point"]
    made.destroy()
    size = np.array([16, 8])
    at = points.astype(np.float64) * size + ON_EDGE
    texel = np.floor(np.nan_to_num(at, nan=-1.0, posinf=-1.0, neginf=-1.0)).astype(int)
    block = np.where((texel >= 0).all(axis=2), texel[..., 0] // 4 + 4 * (texel[..., 1] // 2), -1)
    hits = {"row": (texel[..., 1], 8), "column": (texel[..., 0], 16), "block": (block, 16)}
    found = {name: statistics(places[..., None] == np.arange(count)) for name, (places, count) in hits.items()}
    return {"point": statistics(points), **found}


# ── a picture ──


def run_picture(classes, inputs: Arrays) -> Arrays:
    """The Cornell box with all of the student's classes."""
    return fixtures.lit_cornell_box(classes.A3Renderer, "mis", classes.MeshLightSampler, inputs)


LIGHTS, RENDERER, ENVIRONMENT, IMAGE = "MeshLightSampler", "A3Renderer", "EnvironmentSampler", "Environment"
BOTH = fixtures.run_integrators(("environment", "mis"), LIGHT_SAMPLES)
NUMBERS, AREAS = Numbers(1e-4), Numbers(1e-4, called="triangles")
TEXELS, DENSITIES = Numbers(1e-6, called="texels"), Numbers(1e-5, called="texels")
AREA = fixtures.on_rows("compute_triangle_area", ["v0", "v1", "v2"], {"area": 1})
CONVERSION = fixtures.on_rows("to_solid_angle", ["pdf", "distance", "cos_light"], {"pdf_solid_angle": 1})
HEURISTIC = fixtures.on_rows("power_heuristic", ["pdf", "other_pdf"], {"weight": 1})
PARTS = (
    method(f"{LIGHTS}.compute_triangle_area", 1, POINTS, triangles, AREA, AREAS),
    method(f"{LIGHTS}.compute_cdf", 2, POINTS, lights, run_cdf, AREAS),
    method(f"{LIGHTS}.sample_emissive_triangle", 2, POINTS, lights, run_choice, Samples(called="sets")),
    method(f"{LIGHTS}.evaluate_probability", 1, POINTS, lights, run_density, NUMBERS),
    method(f"{LIGHTS}.sample_mesh_lights", 4, POINTS, lights, run_points, Samples(exact=("length",), called="points")),
    method(f"{RENDERER}.to_solid_angle", 2, MEASURES, densities, CONVERSION, NUMBERS),
    method(f"{RENDERER}.power_heuristic", 1, COMBINED, densities, HEURISTIC, NUMBERS),
    method(f"{RENDERER}.shade_ray", 6, COMBINED, fixtures.lamp_room, BOTH, Samples(called="rays")),
    method(f"{ENVIRONMENT}.compute_probabilities", 2, SKY, image, run_probabilities, TEXELS),
    method(f"{ENVIRONMENT}.evaluate_density", 2, SKY, probabilities, run_sky_density, DENSITIES),
    optional(method(f"{IMAGE}.precompute_scalar", 3, SKY, image, run_scalar, TEXELS)),
    optional(method(f"{IMAGE}.importance_sample_envmap", 5, SKY, image, run_image_points, Samples(called="sets"))),
    picture("mis", 2, fixtures.any_seed, run_picture),
)
