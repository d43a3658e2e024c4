"""What is checked in assignment 3: points on lights, densities of two measures, MIS, environments by their light."""

import numpy as np
import taichi as ti

from taichi_tracer.system import memory
from taichi_tracer.teaching import stand_ins
from taichi_tracer.teaching.base import Arrays, method
from taichi_tracer.teaching.judges import Numbers, Samples, picture, statistics
from taichi_tracer.teaching.rows import WHOLE, rows, samples

POINTS, MEASURES, COMBINED = "sampling lights", "densities per area and per solid angle", "multiple importance sampling"
SKY = "environments by their light"
# With so many samples, the nearest known mistakes are 12 and 10 standard errors from the solution, and 6 pass.
SAMPLES, LIGHT_SAMPLES = 8192, 2048
TRIANGLES = 5

# ── triangles that emit ──


def triangles(rng: np.random.Generator) -> Arrays:
    """100 triangles."""
    return {name: rng.uniform(-2, 2, (100, 3)).astype(np.float32) for name in ("v0", "v1", "v2")}


def run_area(sampler_class: type, inputs: Arrays) -> Arrays:
    """The area of each triangle."""
    return rows(stand_ins.of(sampler_class).compute_triangle_area, inputs, ["v0", "v1", "v2"], {"area": 1})


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
    fields = stand_ins.kept("lights", make_fields, inputs["emissive"], areas.astype(np.float32))
    fields["cdf"].fill(0)
    for i in range(TRIANGLES if has_cdf else 0):
        fields["cdf"][i] = areas[: i + 1].sum() / areas.sum()
    total = float(areas.sum())
    made = stand_ins.of(sampler_class, n_emissive_triangles=TRIANGLES, total_area=total, **fields)
    made.geometry = stand_ins.geometry(inputs)
    return made


def make_fields(ids: np.ndarray, areas: np.ndarray) -> dict:
    """The fields of a sampler of lights."""
    store = memory.Memory()
    fields = {"emissive_triangle_ids": ti.field(ti.i32), "cdf": ti.field(float), "areas": ti.field(float)}
    store.fields.dense(ti.i, len(ids)).place(*fields.values())
    store.allocate()
    for i in range(len(ids)):
        fields["emissive_triangle_ids"][i], fields["areas"][i] = int(ids[i]), float(areas[i])
    return {**fields, "store": store}


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
    place = places_on_triangles(inputs, w_i.astype(np.float64), chosen)
    frequency = statistics(chosen[..., None] == inputs["emissive"])
    return {"w_i": statistics(w_i), "triangle_id": frequency, "place (u, v)": statistics(place)}


def places_on_triangles(inputs: Arrays, w_i: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """(n, m, 2) barycentric coordinates (u, v) at which each direction meets the plane of its own triangle."""
    corners = inputs["vertices"][inputs["faces"]][np.clip(chosen, 0, len(inputs["faces"]) - 1)]
    v0, e1, e2 = corners[..., 0, :], corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    s = inputs["hit_point"].astype(np.float64)[:, None] - v0
    with np.errstate(all="ignore"):
        det = (e1 * np.cross(w_i, e2)).sum(axis=-1)
        u = (s * np.cross(w_i, e2)).sum(axis=-1) / det
        v = (w_i * np.cross(s, e1)).sum(axis=-1) / det
    return np.clip(np.stack([u, v], axis=-1), -10, 10)


# ── densities and weights ──


def densities(rng: np.random.Generator) -> Arrays:
    """Densities, distances and cosines."""
    names = ("pdf", "other_pdf", "distance", "cos_light")
    low, high = np.array([0.05, 0.05, 0.3, 0.1]), np.array([4.0, 4.0, 5.0, 1.0])
    return dict(zip(names, rng.uniform(low, high, (100, 4)).astype(np.float32).T.copy(), strict=True))


def run_conversion(renderer_class: type, inputs: Arrays) -> Arrays:
    """The densities per solid angle."""
    renderer = stand_ins.of(renderer_class)
    return rows(renderer.to_solid_angle, inputs, ["pdf", "distance", "cos_light"], {"pdf_solid_angle": 1})


def run_heuristic(renderer_class: type, inputs: Arrays) -> Arrays:
    """The weights."""
    return rows(stand_ins.of(renderer_class).power_heuristic, inputs, ["pdf", "other_pdf"], {"weight": 1})


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


# ── a picture ──


def run_picture(classes, inputs: Arrays) -> Arrays:
    """The Cornell box with all of the student's classes."""
    return stand_ins.lit_cornell_box(classes.A3Renderer, "mis", classes.MeshLightSampler, inputs)


LIGHTS, RENDERER, ENVIRONMENT = "MeshLightSampler", "A3Renderer", "EnvironmentSampler"
BOTH = stand_ins.run_integrators(("environment", "mis"), LIGHT_SAMPLES)
NUMBERS, AREAS = Numbers(1e-4), Numbers(1e-4, called="triangles")
TEXELS, DENSITIES = Numbers(1e-6, called="texels"), Numbers(1e-5, called="texels")
PARTS = (
    method(f"{LIGHTS}.compute_triangle_area", 1, POINTS, triangles, run_area, AREAS),
    method(f"{LIGHTS}.compute_cdf", 2, POINTS, lights, run_cdf, AREAS),
    method(f"{LIGHTS}.sample_emissive_triangle", 2, POINTS, lights, run_choice, Samples(called="sets")),
    method(f"{LIGHTS}.evaluate_probability", 1, POINTS, lights, run_density, NUMBERS),
    method(f"{LIGHTS}.sample_mesh_lights", 4, POINTS, lights, run_points, Samples(called="points")),
    method(f"{RENDERER}.to_solid_angle", 2, MEASURES, densities, run_conversion, NUMBERS),
    method(f"{RENDERER}.power_heuristic", 1, COMBINED, densities, run_heuristic, NUMBERS),
    method(f"{RENDERER}.shade_ray", 6, COMBINED, stand_ins.lamp_room, BOTH, Samples(called="rays")),
    method(f"{ENVIRONMENT}.compute_probabilities", 2, SKY, image, run_probabilities, TEXELS),
    method(f"{ENVIRONMENT}.evaluate_density", 2, SKY, probabilities, run_sky_density, DENSITIES),
    picture("mis", 2, stand_ins.any_seed, run_picture),
)
