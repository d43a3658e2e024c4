"""How much light does an estimator miss because it draws its directions with the wrong technique?

An estimator that draws directions only from the lights misses what a narrow lobe reflects, because hardly any of them
falls into the lobe. One that draws them only from the BRDF misses a small lamp. What was never met leaves no trace in
the samples, so that their spread does not show it. But a few samples of the other technique show it at once.

Let the other technique draw ω_i with the density q, and let it find the light E = f_r cos θ_i L / q. It has about one
sample in the solid angle 1/q around ω_i. A sample of the estimator, with the density p, falls there with the
probability P = p / q. If the pixel has n samples, n P of them meet this light.

So each of the K samples of the other technique in a pixel that it looks at is a find of the probability P / K, and of
the light E / K: see ``rare_light``. If only one pixel of each tile is looked at, it stands for all of them.

Not even the other technique need find a small sun in a lobe that is much narrower: ``mirror_chains`` follow it.

Only the surfaces that eye rays hit are looked at. Estimators that use both techniques miss nothing in this way, and
nothing is done or compiled for them.

Both densities are those of multiple importance sampling: Veach & Guibas, "Optimally combining sampling techniques for
Monte Carlo rendering", SIGGRAPH 1995.
"""

import math
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.integrators.direct_light import light_along, sample_of_lights
from taichi_tracer.materials import Material
from taichi_tracer.system.parts import PARTS, replaced, unfinished
from taichi_tracer.unseen.rare_light import KNOWN, expected, rows_of
from taichi_tracer.unseen.small_suns import Sun

SAMPLES = 4  # of the other technique, in each pixel that is looked at
MOST_TILES = 128  # pixels along each side that are looked at; of larger pictures, one pixel of each tile
SAFETY = 1.2  # times the light: the tiles and the few samples of a pixel make it rough
SEED = 0x85EBCA6B  # combined with the seed of the picture, so that these samples are not its own
SPHERE = 4 * math.pi  # the solid angle of all directions
# From these on, a lobe has less than about 1/200 of all directions: for the power of a cosine, (1/4π) · 2π/(Ns + 1).
NARROW_FROM, NARROW_BELOW = 100, 0.1


def may_be_narrow(brdf: Any, material: Material) -> bool:
    """Whether a BRDF may have a narrow lobe; of those that do not come with the package, nothing is known."""
    if brdf.is_delta:
        return False
    if material.map_layer or replaced(brdf) or not PARTS.comes_with_package(brdf):
        return True
    if material.is_rough:
        return min(material.alpha_x, material.alpha_y) < NARROW_BELOW
    return material.Ns >= NARROW_FROM


def has_narrow_lobes(scene: Any) -> bool:
    """Whether a material of a scene, a ``SceneInKernels``, may have a narrow lobe that is no mirror's."""
    library, microfacets = scene.material_library, scene.microfacets
    used = map(int, scene.geometry.mesh.used_materials())
    return any(
        may_be_narrow(library.brdfs[library.brdf_of[microfacets][i]], library.materials[i].modelled(microfacets))
        for i in used
    )


def other_techniques(scene, integrator, pixels: int, suns: list[Sun]) -> tuple[str, ...]:
    """The techniques, "brdf" or "lights", that find light which an integrator may never meet.

    Args:
        scene: a ``SceneInKernels``. pixels: of the picture. suns: of the scene.
    """
    brdfs = [scene.material_library.brdfs[i] for i in scene.effects.brdfs]
    if not (integrator.needs_light and scene.effects.samples_lights) or any(map(unfinished, brdfs)):
        return ()
    found = []
    if not integrator.samples_brdf and has_narrow_lobes(scene):
        found.append("brdf")
    if not integrator.samples_lights:
        shares = [float(sun.solid_angles.sum()) for sun in suns]
        if scene.lights.has_lamps:
            size, areas = float((scene.geometry.high - scene.geometry.low).max()), scene.lights.lamps.table.areas
            shares.append(expected(areas).min() / size**2)  # a large lamp says nothing of a small one
        if shares and pixels * min(shares) < KNOWN * SPHERE:
            found.append("lights")
    return tuple(found)


def by_other_techniques(renderer: Any, suns: list[Sun]) -> list[np.ndarray]:
    """The rows of what each of the other techniques finds in a renderer's picture.

    Pixels stand for tiles of the picture, so that at most ``MOST_TILES`` are looked at along each side.
    """
    scene, integrator, (x0, x1, y0, y1) = renderer.kernel_scene(), renderer.active, renderer.film.crop
    pixels = (x1 - x0) * (y1 - y0)
    step = math.ceil(max(x1 - x0, y1 - y0) / MOST_TILES)
    rows, columns = (-(-n // step) for n in (y1 - y0, x1 - x0))
    found = []
    for technique in other_techniques(scene, integrator, pixels, suns):
        scene.lights.prepare()
        from_brdf = technique == "brdf"
        has_density = integrator.samples_lights if from_brdf else integrator.samples_brdf
        parts, samples = (scene, renderer.eye_rays, renderer.sampler), np.empty((SAMPLES, rows, columns, 2), np.float32)
        _sample_tiles(*parts, from_brdf, has_density, (renderer.seed ^ SEED) % 2**32, x0, y0, step, samples)
        k, row, column = np.nonzero(samples[..., 0])
        light, chance = samples[k, row, column].T.astype(np.float64) / SAMPLES
        of_tile = pixels / (rows * columns)  # in the mean square, a tile counts as so many pixels
        number = step * (row * (x1 - x0) + column)
        found.append(rows_of(number, of_tile * chance, SAFETY * math.sqrt(of_tile) * light))
    return found


@ti.kernel
def _sample_tiles(
    scene: ti.template(),
    eye_rays: ti.template(),
    sampler: ti.template(),
    from_brdf: ti.template(),
    has_density: ti.template(),
    seed: ti.u32,
    x0: ti.i32,
    y0: ti.i32,
    step: ti.i32,
    found: ti.types.ndarray(ndim=4),
):
    """(E, P) of samples of the other technique at what eye rays hit; 0 where it finds no light.

    Args:
        from_brdf: whether the other technique draws directions from the BRDF. has_density: whether the estimator draws
            its own with the density of its technique, and not uniform on the sphere.
        step: the side of a tile in pixels. found: (SAMPLES, rows, columns, 2).
    """
    for k, row, column in ti.ndrange(found.shape[0], found.shape[1], found.shape[2]):
        x, y = x0 + column * step, y0 + row * step
        rng = sampler.start(seed, x, y, ti.cast(k, ti.u32))
        ray, hit = eye_rays.hit_of(x, y, rng)
        light, chance = 0.0, 0.0
        if hit.is_hit:
            surface = scene.surface_at(ray, hit)
            if not surface.is_delta():
                value, p, q = other_sample(scene, surface, rng, from_brdf)
                if ti.static(not has_density):
                    p = 1 / SPHERE
                if q > 0 and abs(value).sum() < tm.inf:
                    light, chance = tm.sqrt(tm.dot(value, value) / 3), p / q
        found[k, row, column, 0], found[k, row, column, 1] = ti.cast(light, ti.f32), ti.cast(chance, ti.f32)


@ti.func
def other_sample(scene: ti.template(), surface, rng, from_brdf: ti.template()):
    """(E, p, q) of one sample at a surface, where p is the density of the technique that the estimator uses."""
    if ti.static(from_brdf):
        w_i = surface.sample(rng.next_2d())
        light, p = light_along(scene, surface, w_i, surface.weight(w_i))
        return surface.weight(w_i) * light, p, surface.pdf(w_i)
    f_cos, light, q, p = sample_of_lights(scene, surface, rng.next_2d_of_term())
    return f_cos * light / q, p, q
