"""How large is the error of a picture with each sampler at equal counts, and what does a sample cost?

python -m benchmarks.samplers [errors | compensation | mitsuba | times ...]

``errors`` compares the package's own samplers, and ``mitsuba`` those that tell their error with Mitsuba's. The error
is the relative RMSE against a reference; a row is the root mean square over ``SEEDS`` renders. The slope is that of the
line through the logarithms of counts and errors. Pixels in which a lamp is seen, and those beside them, are left out:
their error is that of the lamp's edges. "sobol, one replica" and "niederreiter" give all samples to one sequence.

``compensation`` compares samples of all light with samples of the light that is above the mean of the environment, see
``lights.environment_light``.
"""

import math
import sys
from collections.abc import Callable

import numpy as np
import taichi as ti

import taichi_tracer as tt
from benchmarks.measure import describe_machine, interleaved, ratio_table
from benchmarks.mitsuba_scenes import MitsubaPicture, path
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.geometry import Mesh
from taichi_tracer.integrators.direct_light import MultipleImportanceSampling
from taichi_tracer.materials import Material
from taichi_tracer.picture.metrics import relative_rmse
from taichi_tracer.samplers.sobol import SobolSampler

SIZE, COUNTS, SEEDS = 96, (4, 16, 64, 256), 3
REFERENCE_SPP, REFERENCE_SEED = 4096, 10**6
SKY_SIZE, SUN_DEGREES, SUN_RADIANCE = (64, 128), 5.0, 20.0
TIMED_SIZE, TIMED_SPP, RUNS = 256, 8, 15
OURS, THEIRS = ("sobol", "niederreiter_two", "niederreiter"), ("independent", "multijitter", "orthogonal", "ldsampler")
MORE_COUNTS, MORE_REFERENCE = (4, 16, 64, 256, 1024), 16384  # of the comparison with Mitsuba


@ti.data_oriented
class OneSobol(SobolSampler):
    """All samples belong to the first of the two sequences."""

    name, replicated = "sobol, one replica", False

    @ti.func
    def point(self, seed, pixel, index, dimension):
        """The numbers of every second sample."""
        return SobolSampler.point(self, seed, pixel, index << 1, dimension)


SAMPLERS = ("independent", "sobol", OneSobol(), "niederreiter_two", "niederreiter")


def sun_and_sky() -> np.ndarray:
    """(h, w, 3) radiance: a sky that is brighter at the horizon, and a sun that stands high behind the camera."""
    height, width = SKY_SIZE
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    elevation, azimuth = np.pi * (0.5 - v), 2 * np.pi * (u - 0.5)
    d = np.stack([np.cos(elevation) * np.cos(azimuth), np.sin(elevation), np.cos(elevation) * np.sin(azimuth)], -1)
    sky = (1 - 0.6 * np.abs(d[..., 1:2])) * np.array([0.5, 0.7, 1.0])
    sun = np.array([0.5, 1.0, 0.8]) / np.linalg.norm([0.5, 1.0, 0.8])
    sky[d @ sun > np.cos(np.radians(SUN_DEGREES))] += SUN_RADIANCE
    return sky


SPHERES_VIEW = {"eye": (0, 1.4, 3.6), "at": (0, 0.4, 0), "up": (0, 1, 0), "fov": 45.0}


def three_spheres() -> Mesh:
    """Spheres with Ns 1, 20 and 200 on a floor."""
    materials = [Material("floor", Kd=(0.5, 0.5, 0.5))]
    materials += [Material(f"Ns {ns}", Kd=(0.8, 0.7, 0.6), Ns=ns) for ns in (1, 20, 200)]
    floor = np.array([[-6, 0, 6], [6, 0, 6], [6, 0, -6], [-6, 0, -6]], float)
    return Mesh(
        vertices=floor,
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        face_materials=np.zeros(2, np.int32),
        materials=materials,
        spheres=np.array([[-1.2, 0.5, 0, 0.5], [0, 0.5, 0, 0.5], [1.2, 0.5, 0, 0.5]]),
        sphere_ids=np.array([2, 3, 4], np.int32),
        sphere_materials=np.array([1, 2, 3], np.int32),
    )


def spheres_on_floor(environment) -> tt.SceneData:
    """The three spheres on a floor."""
    return tt.SceneData(three_spheres(), view=SPHERES_VIEW, environment=environment)


def spheres_under_sun() -> tt.SceneData:
    """Three spheres on a floor, under sun and sky."""
    return spheres_on_floor(sun_and_sky())


def under_studio(name):
    """What makes a shipped scene under the studio."""
    return lambda: tt.load_scene_data(name, environment="studio")


def direct(scene, sampler, seed=0, size=SIZE):
    """A picture of direct light with MIS."""
    return tt.A2Renderer(scene, size, size, sampler=sampler, seed=seed).use("mis")


def paths(name):
    """What makes a picture with light that bounces up to 5 times."""
    return lambda scene, sampler, seed=0, size=SIZE: tt.A4Renderer(scene, size, size, sampler=sampler, seed=seed).use(
        name
    )


# What is rendered: what makes the scene, and what makes the picture.
PICTURES = {
    "spheres under a sun, mis": (spheres_under_sun, direct),
    "specular_spheres under studio, mis": (under_studio("specular_spheres"), direct),
    "cornell_box under studio, mis": (under_studio("cornell_box"), direct),
    "cornell_box, mis": (lambda: tt.load_scene_data("cornell_box"), direct),
    "veach_plates, mis": (lambda: tt.load_scene_data("veach_plates"), direct),
    "torus_knot under studio, mis": (under_studio("torus_knot"), direct),
    "cornell_box, path": (lambda: tt.load_scene_data("cornell_box"), paths("path")),
    "cornell_box, explicit": (lambda: tt.load_scene_data("cornell_box"), paths("explicit")),
    "cornell_box, implicit": (lambda: tt.load_scene_data("cornell_box"), paths("implicit")),
    "specular_spheres under studio, path": (under_studio("specular_spheres"), paths("path")),
}


def errors(pictures=PICTURES, samplers=SAMPLERS) -> str:
    """A table for every picture: the error of each sampler at each count, in percent."""
    report = ""
    for title, (load, make) in pictures.items():
        scene = load()
        reference = make(scene, "niederreiter", REFERENCE_SEED).render(REFERENCE_SPP)
        truth, is_counted = reference.image().astype(np.float64), ~beside_lamps(reference)
        lines = [f"\n**{title}, {SIZE}²; error of the reference {float(reference.error()):.2%}**\n"]
        lines += [f"| relative RMSE, % | {' | '.join(map(str, COUNTS))} | slope |"]
        lines += ["|---|" + "--:|" * (len(COUNTS) + 1)]
        for sampler in samplers:
            found = error_of_counts(make(scene, sampler), truth, is_counted)
            slope = np.polyfit(np.log(COUNTS), np.log(found), 1)[0]
            name = sampler if isinstance(sampler, str) else sampler.name
            lines.append(f"| {name} | {' | '.join(f'{100 * e:.3g}' for e in found)} | {slope:.2f} |")
        report += "\n".join(lines) + "\n"
        print("\n".join(lines), file=sys.stderr, flush=True)
        scene.destroy()
    return report


def beside_lamps(renderer) -> np.ndarray:
    """(h, w): whether the pixel or one of its neighbours shows a lamp."""
    emits = np.array([max(material.Ke) > 0 for material in renderer.scene_data.mesh.materials] + [False])
    is_lamp = np.pad(emits[renderer.aov("material_id")], 1)
    height, width = renderer.height, renderer.width
    return np.any([is_lamp[i : i + height, j : j + width] for i in range(3) for j in range(3)], axis=0)


def error_of_counts(renderer, truth: np.ndarray, is_counted: np.ndarray, counts=COUNTS) -> list[float]:
    """The root mean square of the errors of several seeds, at every count, over the pixels that count."""
    squares = np.zeros(len(counts))
    for seed in range(SEEDS):
        renderer.seed = seed
        renderer.begin_anew()
        done = 0
        for k, count in enumerate(counts):
            renderer.render(count - done)
            done = count
            squares[k] += relative_rmse(renderer.image()[is_counted], truth[is_counted]) ** 2
    return [math.sqrt(total / SEEDS) for total in squares]


@ti.data_oriented
class OfAllLight(MultipleImportanceSampling):
    """MIS whose samples of the light leave nothing to the BRDF."""

    compensates = False  # type: ignore[assignment]


def even_sky() -> np.ndarray:
    """The sky of ``sun_and_sky``, without the sun."""
    return np.minimum(sun_and_sky(), np.array([0.5, 0.7, 1.0]))


COMPENSATED = {
    "sky with a sun": sun_and_sky(),
    "the same sky without it": even_sky(),
    "sunny": "sunny",
    "studio": "studio",
}
COMPENSATION_SPP = 64


def compensation() -> str:
    """A table: the error of MIS whose light's samples are of all light, and of the light above its mean."""
    samplers = "independent", "niederreiter"
    lines = [f"\n**three spheres on a floor, mis, {SIZE}², {COMPENSATION_SPP} samples**\n"]
    heads = [f"{name}: {how}" for name in samplers for how in ("of all light", "above the mean")]
    lines += [f"| relative RMSE, % | {' | '.join(heads)} |", "|---|" + "--:|" * len(heads)]
    for title, environment in COMPENSATED.items():
        scene = spheres_on_floor(environment)
        truth = direct(scene, "niederreiter", REFERENCE_SEED).render(REFERENCE_SPP).image().astype(np.float64)
        everywhere, cells = np.ones(truth.shape[:2], bool), []
        for sampler in samplers:
            for estimator in (OfAllLight("of_all_light", "", 2), "mis"):
                renderer = direct(scene, sampler).use(estimator)
                (error,) = error_of_counts(renderer, truth, everywhere, (COMPENSATION_SPP,))
                cells.append(f"{100 * error:.3g}")
        lines.append(f"| {title} | {' | '.join(cells)} |")
        scene.destroy()
    return "\n".join(lines) + "\n"


DIRECT = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1}  # Mitsuba's MIS


def their_sky() -> np.ndarray:
    """The environment that is shipped as "studio"."""
    return np.load(shipped_environments()["studio"])


# The pictures of which Mitsuba makes its own: what makes them there, for a sampler.
THEIR_PICTURES: dict[str, Callable[[str], MitsubaPicture]] = {
    "spheres under a sun, mis": lambda sampler: MitsubaPicture(
        three_spheres(), DIRECT, SIZE, SIZE, sampler=sampler, environment=sun_and_sky(), view=SPHERES_VIEW
    ),
    "specular_spheres under studio, mis": lambda sampler: MitsubaPicture(
        "specular_spheres", DIRECT, SIZE, SIZE, sampler=sampler, environment=their_sky()
    ),
    "cornell_box, mis": lambda sampler: MitsubaPicture("cornell_box", DIRECT, SIZE, SIZE, sampler=sampler),
    "veach_plates, mis": lambda sampler: MitsubaPicture("veach_plates", DIRECT, SIZE, SIZE, sampler=sampler),
    "cornell_box, path": lambda sampler: MitsubaPicture("cornell_box", path(5), SIZE, SIZE, sampler=sampler),
}


def mitsuba() -> str:
    """A table for every picture that Mitsuba can make, too: errors at equal counts, each against its own reference.

    Where Mitsuba takes more samples than it was asked for, their number stands behind the error. Its glossy BRDF is
    another one of the same width.
    """
    report = ""
    for title, make_theirs in THEIR_PICTURES.items():
        load, make = PICTURES[title]
        scene = load()
        reference = make(scene, "niederreiter", REFERENCE_SEED).render(MORE_REFERENCE)
        truth, is_counted = reference.image().astype(np.float64), ~beside_lamps(reference)
        # The course's camera is left-handed, so that its pictures are mirrored.
        theirs = make_theirs("multijitter").render(MORE_REFERENCE, seed=REFERENCE_SEED)[:, ::-1].astype(np.float64)
        difference = relative_rmse(theirs[is_counted], truth[is_counted])
        lines = [f"\n**{title}, {SIZE}²; our reference and Mitsuba's differ by {difference:.2%}**\n"]
        lines += [f"| relative RMSE, % | {' | '.join(map(str, MORE_COUNTS))} |", "|---|" + "--:|" * len(MORE_COUNTS)]
        for name in OURS:
            found = error_of_counts(make(scene, name), truth, is_counted, MORE_COUNTS)
            lines.append(f"| {name} | {' | '.join(f'{100 * e:.3g}' for e in found)} |")
        for name in THEIRS:
            peer, cells = make_theirs(name), []
            for count in MORE_COUNTS:
                images = [peer.render(count, seed=seed)[:, ::-1][is_counted] for seed in range(1, SEEDS + 1)]
                error = math.sqrt(np.mean([relative_rmse(image, theirs[is_counted]) ** 2 for image in images]))
                real = peer.real_count(count)
                cells.append(f"{100 * error:.3g}" + (f" ({real})" if real != count else ""))
            lines.append(f"| Mitsuba, {name} | {' | '.join(cells)} |")
        report += "\n".join(lines) + "\n"
        print("\n".join(lines), file=sys.stderr, flush=True)
        scene.destroy()
    return report


def times() -> str:
    """Tables: milliseconds for one sample of every pixel, the samplers taking turns."""
    report = ""
    for title in ("specular_spheres under studio, mis", "cornell_box, path"):
        load, make = PICTURES[title]
        scene = load()
        renderers = {name: make(scene, name, size=TIMED_SIZE) for name in ("sobol", "niederreiter", "independent")}

        def render(renderer):
            renderer.render(TIMED_SPP)
            ti.sync()

        seconds = interleaved({name: lambda r=r: render(r) for name, r in renderers.items()}, RUNS)
        per_sample = {name: value / TIMED_SPP for name, value in seconds.items()}
        report += ratio_table(f"{title}, {TIMED_SIZE}²", per_sample, "sobol", "ms per sample")
    return report


PARTS = {"errors": errors, "compensation": compensation, "mitsuba": mitsuba, "times": times}


if __name__ == "__main__":
    tt.init(arch="auto")
    print(describe_machine() + "".join(PARTS[name]() for name in sys.argv[1:] or PARTS))
