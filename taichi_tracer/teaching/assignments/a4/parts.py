"""What is checked in assignment 4: throughput, roulette, next-event estimation, and whole paths."""

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.contracts.lab import bound
from taichi_tracer.ray import offset_origin
from taichi_tracer.teaching import fixtures
from taichi_tracer.teaching.base import Arrays, Numbers, Samples, method, picture, statistics
from taichi_tracer.teaching.fixtures import samples

PATHS, ROULETTE, EVENTS = "paths", "Russian roulette", "next-event estimation"
# With so many samples, the nearest known mistakes are 97 and 9 standard errors from the solution, and 6 pass.
SAMPLES, PATH_SAMPLES = 8192, 8192
BOUNCES = 3


def bounces(rng: np.random.Generator) -> Arrays:
    """Throughputs, reflections and densities."""
    f32 = np.float32
    return {
        "throughput": rng.uniform(0, 2, (100, 3)).astype(f32),
        "f_r": rng.uniform(0, 1, (100, 3)).astype(f32),
        "cosine": rng.uniform(0.05, 1, 100).astype(f32),
        "pdf": rng.uniform(0.1, 2, 100).astype(f32),
    }


def games(rng: np.random.Generator) -> Arrays:
    """Throughputs and probabilities of ending; one is 0."""
    q = rng.uniform(0.1, 0.8, 6)
    q[0] = 0
    return {"throughput": rng.uniform(0.2, 2, (6, 3)).astype(np.float32), "q": q.astype(np.float32)}


def run_roulette(renderer_class: type, inputs: Arrays) -> Arrays:
    """The throughputs after many games of each row."""
    play = fixtures.bare(renderer_class).play_roulette
    found = samples(play, inputs, ["throughput", "q"], {"throughput": 3}, SAMPLES)
    return {"throughput": statistics(found["throughput"])}


@ti.func
def reflected(renderer: ti.template(), origin, direction):
    """A sample of the light that the lamps send by one reflection along a ray."""
    hit = renderer.scene_data.ray_intersector.query_ray(tt.Ray(origin=origin, direction=direction))
    x = offset_origin(hit.position, hit.position_error, hit.normal)
    return renderer.sample_light(hit, x, -direction)


def run_event(renderer_class: type, inputs: Arrays) -> Arrays:
    """Samples of the light that the lamps send by one reflection."""
    light = bound(reflected, renderer_class(fixtures.scene(inputs), 8, 8))
    return {"light": statistics(samples(light, inputs, ["origin", "direction"], {"light": 3}, PATH_SAMPLES)["light"])}


def two_rooms(rng: np.random.Generator) -> Arrays:
    """A closed room that emits everywhere, where light bounces often, and a room with two lamps."""
    closed = {f"closed {name}": array for name, array in fixtures.closed_room(rng).items()}
    return {**fixtures.lamp_room(rng), **closed}


def run_paths(renderer_class: type, inputs: Arrays) -> Arrays:
    """Samples of implicit paths in the closed room, and of explicit ones under the lamps; roulette begins early."""
    closed = {name.removeprefix("closed "): array for name, array in inputs.items() if name.startswith("closed ")}
    found = {}
    for mode, room in (("implicit", closed), ("explicit", inputs)):
        renderer = renderer_class(fixtures.scene(room), 8, 8).use(mode)
        renderer.max_bounces, renderer.rr_start_bounce, renderer.rr_termination_probability = BOUNCES, 1, 0.3
        found[f"radiance ({mode})"] = fixtures.light_along(renderer, room, PATH_SAMPLES)
    return found


def run_picture(classes, inputs: Arrays) -> Arrays:
    """The Cornell box after some bounces."""
    return fixtures.lit_cornell_box(classes.A4Renderer, "explicit", tt.MeshLightSampler, inputs)


THROUGHPUT = fixtures.on_rows("next_throughput", ["throughput", "f_r", "cosine", "pdf"], {"throughput": 3})
PARTS = (
    method("A4Renderer.next_throughput", 2, PATHS, bounces, THROUGHPUT, Numbers(1e-4, called="bounces")),
    method("A4Renderer.play_roulette", 2, ROULETTE, games, run_roulette, Samples(called="games")),
    method("A4Renderer.sample_light", 4, EVENTS, fixtures.lamp_room, run_event, Samples(called="rays")),
    method("A4Renderer.shade_ray", 8, PATHS, two_rooms, run_paths, Samples(called="rays", for_means=0.8)),
    picture("explicit", 2, fixtures.any_seed, run_picture),
)
