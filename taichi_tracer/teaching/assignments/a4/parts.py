"""What is checked in assignment 4: throughput, roulette, next-event estimation, and whole paths."""

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.ray import offset_origin
from taichi_tracer.teaching import stand_ins
from taichi_tracer.teaching.base import Arrays, Part
from taichi_tracer.teaching.judges import Numbers, Pictures, Samples, statistics
from taichi_tracer.teaching.stand_ins import ray_of, vector, write, write_sample

PATHS, ROULETTE, EVENTS = "paths", "Russian roulette", "next-event estimation"
SEED, SAMPLES, PATH_SAMPLES, BOUNCES = 5, 8192, 2048, 2


def bounces(rng: np.random.Generator) -> Arrays:
    """Throughputs, reflections and densities."""
    f32 = np.float32
    return {
        "throughput": rng.uniform(0, 2, (100, 3)).astype(f32),
        "f_r": rng.uniform(0, 1, (100, 3)).astype(f32),
        "cosine": rng.uniform(0.05, 1, 100).astype(f32),
        "pdf": rng.uniform(0.1, 2, 100).astype(f32),
    }


@ti.kernel
def throughput_kernel(
    renderer: ti.template(),
    throughput: ti.types.ndarray(ndim=2),
    f_r: ti.types.ndarray(ndim=2),
    cosine: ti.types.ndarray(ndim=1),
    pdf: ti.types.ndarray(ndim=1),
    new: ti.types.ndarray(ndim=2),
):
    """The throughput of each path after its bounce."""
    for i in range(cosine.shape[0]):
        write(new, i, renderer.next_throughput(vector(throughput, i), vector(f_r, i), cosine[i], pdf[i]))


def run_throughput(renderer_class: type, inputs: Arrays) -> Arrays:
    """The throughputs after the bounces."""
    new = np.zeros((100, 3), np.float32)
    arrays = [inputs[name] for name in ("throughput", "f_r", "cosine", "pdf")]
    throughput_kernel(stand_ins.of(renderer_class), *arrays, new)
    return {"throughput": new}


def games(rng: np.random.Generator) -> Arrays:
    """Throughputs and probabilities of ending; one is 0."""
    q = rng.uniform(0.1, 0.8, 6)
    q[0] = 0
    return {"throughput": rng.uniform(0.2, 2, (6, 3)).astype(np.float32), "q": q.astype(np.float32)}


@ti.kernel
def roulette_kernel(
    renderer: ti.template(),
    random: ti.template(),
    throughput: ti.types.ndarray(ndim=2),
    q: ti.types.ndarray(ndim=1),
    new: ti.types.ndarray(ndim=3),
):
    """Many games of roulette for each row."""
    for i, j in ti.ndrange(new.shape[0], new.shape[1]):
        random.start(SEED, i, 0, j)
        write_sample(new, i, j, renderer.play_roulette(vector(throughput, i), q[i]))


def run_roulette(renderer_class: type, inputs: Arrays) -> Arrays:
    """Many games."""
    new = np.zeros((6, SAMPLES, 3), np.float32)
    roulette_kernel(stand_ins.of(renderer_class), stand_ins.sampler(6), inputs["throughput"], inputs["q"], new)
    return {"throughput": statistics(new)}


@ti.kernel
def event_kernel(
    renderer: ti.template(),
    random: ti.template(),
    origin: ti.types.ndarray(ndim=2),
    direction: ti.types.ndarray(ndim=2),
    light: ti.types.ndarray(ndim=3),
):
    """Samples of the light that the lamps send to what each ray hits."""
    for i, j in ti.ndrange(light.shape[0], light.shape[1]):
        random.start(SEED, i, 0, j)
        ray = ray_of(origin, direction, i)
        hit = renderer.scene_data.ray_intersector.query_ray(ray)
        x = offset_origin(hit.position, hit.position_error, hit.normal)
        write_sample(light, i, j, renderer.sample_light(hit, x, -ray.direction))


def run_event(renderer_class: type, inputs: Arrays) -> Arrays:
    """Samples of the light that the lamps send by one reflection."""
    renderer = renderer_class(stand_ins.lamp_scene(inputs), 8, 8)
    light = np.zeros((len(inputs["origin"]), PATH_SAMPLES, 3), np.float32)
    event_kernel(renderer, stand_ins.sampler(len(light)), inputs["origin"], inputs["direction"], light)
    return {"light": statistics(light)}


def two_rooms(rng: np.random.Generator) -> Arrays:
    """A closed room that emits everywhere, where light bounces often, and a room with two lamps."""
    closed = {f"closed {name}": array for name, array in stand_ins.closed_room(rng).items()}
    return {**stand_ins.lamp_room(rng), **closed}


def run_paths(renderer_class: type, inputs: Arrays) -> Arrays:
    """Samples of implicit paths in the closed room, and of explicit ones under the lamps; roulette begins early."""
    closed = {name.removeprefix("closed "): array for name, array in inputs.items() if name.startswith("closed ")}
    found = {}
    for mode, room in (("implicit", closed), ("explicit", inputs)):
        renderer = renderer_class(stand_ins.lamp_scene(room), 8, 8).use(mode)
        renderer.max_bounces, renderer.rr_start_bounce, renderer.rr_termination_probability = BOUNCES, 1, 0.3
        found[f"radiance ({mode})"] = statistics(stand_ins.light_along(renderer, room, PATH_SAMPLES))
    return found


def run_picture(classes, inputs: Arrays) -> Arrays:
    """The Cornell box after some bounces."""
    return stand_ins.lit_cornell_box(classes.A4Renderer, "explicit", tt.MeshLightSampler, inputs)


NAME = "A4Renderer"
PARTS = (
    Part(f"{NAME}.next_throughput", 2, PATHS, NAME, bounces, run_throughput, Numbers(1e-4, called="bounces")),
    Part(f"{NAME}.play_roulette", 2, ROULETTE, NAME, games, run_roulette, Samples(called="games")),
    Part(f"{NAME}.sample_light", 4, EVENTS, NAME, stand_ins.lamp_room, run_event, Samples(called="rays")),
    Part(f"{NAME}.shade_ray", 8, PATHS, NAME, two_rooms, run_paths, Samples(called="rays")),
    Part("picture: explicit", 2, "the whole pipeline", "", stand_ins.any_seed, run_picture, Pictures()),
)
