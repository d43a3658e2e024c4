"""What a sample of a picture is made of: the parts that the central kernel asks, in ``ProgressiveRenderer``."""

from typing import Any, NamedTuple

import taichi as ti

from taichi_tracer.camera import ProjectiveCamera, through_pixel
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.ray import no_hit


@ti.data_oriented
class EyeRays:
    """The ray of every pixel and its hit: ``generate_ray``, then ``query_ray``.

    Args:
        scene_data: the ``SceneData``. camera: makes the rays. jitter: whether a ray passes through a random point.
        traces: whether the ray is traced here. It is False if a replaced ``shade_ray`` traces the ray itself.
    """

    def __init__(self, scene_data: Any, camera: ProjectiveCamera, jitter: bool, traces: bool = True) -> None:
        self.camera, self.intersector = camera, scene_data.ray_intersector
        self.jitter, self.traces = jitter, traces

    @ti.func
    def hit_of(self, x, y, rng):
        """(ray, HitData) of a pixel; the first pair of random numbers is the point within the pixel (A2-1)."""
        ray = through_pixel(self.camera.generate_ray, x, y, self.jitter, rng.next_2d())
        if ti.static(self.traces):
            return ray, self.intersector.query_segment(ray, 0.0, tm.inf)
        return ray, no_hit()


class SampleParts(NamedTuple):
    """The parts. Who watches samples puts observed copies in the places of some: ``system.observed``."""

    scene: Any  # a ``SceneInKernels``
    integrator: Any
    eye_rays: EyeRays
    sampler: Any
    shares: Any
    film: Any  # a ``Film``, or what takes samples in its place
