"""What every integrator must do: finite samples everywhere; of an estimator, a mean that is the radiance.

The means are those of a diffuse plane, on which nothing casts a shadow, so that they are known in closed form however
many times light is reflected. An estimator is held to: emission, light from all directions, light from a single one,
and what rays see that meet nothing. A view has a colour in [0, 1] of every hit, the same each time; a miss is black.
"""

import numpy as np

import taichi_tracer as tt
from taichi_tracer.contracts.intersectors import all_primitives
from taichi_tracer.contracts.lab import SQUARE
from taichi_tracer.contracts.statistics import check_range, largest_z
from taichi_tracer.geometry import Mesh

SIZE, SPP = 32, 256  # pixels of a side, samples of a pixel
KD, KE = np.array([0.8, 0.5, 0.2]), np.array([0.0, 0.3, 0.1])
ROUNDING = 3e-6  # of the mean of samples that are all alike
ROUNDING_OF_VIEWS = 1e-6  # of 0 and 1, where barycentric coordinates are added up
SUN, IRRADIANCE = np.array([0.48, 0.8, 0.36]), np.array([2.0, 1.0, 0.5])
SKY_ROWS = 8


def sun():
    """Light from one direction."""
    return tt.DirectionalLight(tuple(-SUN), tuple(IRRADIANCE))


# ── the checks ──


def check_sky_sun_and_emission(estimator):
    """Under sky and sun a plane has its closed form, and a miss sees the sky.

    It is Ke + Kd Σ L_k (cos² θ_k − cos² θ_k+1) + Kd/π E cos θ, with rows of sky L_k between polar angles, and a sun E.
    """
    rows = np.random.default_rng(11).uniform(0.1, 2, (SKY_ROWS, 3))  # the radiance of each row of texels
    sky = np.tile(rows[:, None], (1, 2 * SKY_ROWS, 1))
    corners = SQUARE[0][:, [0, 2, 1]] * 3
    mesh = Mesh(corners, SQUARE[1][:, ::-1], materials=[tt.Material(Kd=tuple(KD), Ke=tuple(KE))])  # its front is above
    scene = tt.SceneData(mesh, environment=sky, lights=[sun()])
    camera = tt.Camera(SIZE, SIZE, eye=(0.2, 1.5, 0.3), at=(0, 0, 0), fov=70)  # sees nothing but the square
    renderer = tt.A2Renderer(scene, camera=camera, sampler="independent", integrator=estimator).render(SPP)
    mean, variance = (values.mean(axis=(0, 1)) for values in (renderer.image(), renderer.film.variance_of_mean()))

    camera.set_camera_parameters(at=(0.2, 9, 1))
    renderer.reset()
    above = rows[: SKY_ROWS // 2]
    seen = f"{estimator.name}: a miss does not see the sky: it"
    check_range(seen, renderer.render(SPP).image(), 0.99 * above.min(), 1.01 * above.max())

    cosine = np.cos(np.pi * np.arange(SKY_ROWS // 2 + 1) / SKY_ROWS)
    from_sky = (above * (cosine[:-1] ** 2 - cosine[1:] ** 2)[:, None]).sum(axis=0)
    expected = KE + KD * (from_sky + IRRADIANCE * SUN[1] / np.pi)
    spread = np.sqrt(variance / SIZE**2) + ROUNDING * expected
    z = np.abs(mean - expected) / spread
    assert z.max() < largest_z(len(z)), (
        f"{estimator.name}: under sky and sun, a plane has the radiance {mean}, not {expected}: {z.max():.1f} standard "
        "errors"
    )


def rendered(integrator, spp):
    """A picture of triangles, spheres, vertex normals, one-sided triangles and all BRDFs, whose samples are finite."""
    scene = tt.SceneData(all_primitives(np.random.default_rng(20)), environment="studio", lights=[sun()])
    renderer_class = {"view": tt.A1Renderer, "integrator": tt.RT3Renderer}.get(integrator.what, tt.A2Renderer)
    around = tt.Camera(SIZE, SIZE, eye=(0.5, 1, 4), at=(0, 0, 0), fov=50)
    renderer = renderer_class(scene, camera=around, integrator=integrator).render(min(SPP, spp))
    assert renderer.non_finite == 0, f"{integrator.name}: {renderer.non_finite} samples are not finite"
    return renderer


def check_samples_are_finite(integrator):
    """Samples are finite, and none is below 0: triangles, spheres, vertex normals, one-sided triangles, all BRDFs."""
    check_range(f"{integrator.name}: a pixel", rendered(integrator, 16).image(), 0)


def check_view(view):
    """Colours in [0, 1], the same each time; a miss is black.

    Of spheres the colour need only be finite: their ``barycentric_coords`` are longitude and latitude, which have no
    third.
    """
    renderer = rendered(view, 1)
    ids, image = renderer.aov("triangle_id"), renderer.image()
    of_triangles, missed = image[(ids >= 0) & ~np.isin(ids, renderer.scene_data.mesh.sphere_ids)], image[ids < 0]
    check_range(f"{view.name}: a colour", of_triangles, -ROUNDING_OF_VIEWS, 1 + ROUNDING_OF_VIEWS)
    assert not missed.any(), f"{view.name}: a miss is not black, but {missed.max(axis=0)}"
    renderer.reset()
    assert np.array_equal(renderer.render().image(), image), f"{view.name}: the second picture differs from the first"
