"""A scene as students' files of the course see it: triangles are counted from 1, and so are the ids that are stored.

``EnvISRenderer`` shows where samples of an environment fall, as counts in a picture of it (A3-6).
"""

from enum import IntEnum
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.environment import Environment
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.lights.environment_light import EnvironmentLight
from taichi_tracer.lights.mesh_light_sampler import MeshLightSampler
from taichi_tracer.ray import HitData
from taichi_tracer.samplers.independent import IndependentSampler
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system.compile_time import element, inside_kernel
from taichi_tracer.system.course_fields import held
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.memory import filled
from taichi_tracer.system.parts import call_with_known_args


@ti.func
def shifted(hit, step, miss):
    """A HitData whose triangle's id is greater by a step; or ``miss``.

    The package's count from 0, and a student's from 1. A miss of a student's is all zeros: its material may be read.
    """
    found = miss
    if hit.is_hit:
        found = hit
        found.triangle_id += step
    return found


class OfPackage:
    """An object with the course's conventions in place of one of the package's, whose other attributes it has."""

    def __init__(self, package: Any) -> None:
        self.package = package

    def __getattr__(self, name: str) -> Any:
        return getattr(vars(self)["package"], name)


class CourseGeometry(OfPackage):
    """The package's geometry with ids that count from 1.

    Attributes:
        triangle_vertex_ids, triangle_normal_ids: fields of three ids for each triangle, counted from 1.
    """

    def __init__(self, geometry: Any) -> None:
        super().__init__(geometry)
        count = max(1, int(geometry.n_triangles))
        ids = geometry.triangle_vertex_ids.to_numpy()[:count]
        normal_ids = geometry.triangle_normal_ids.to_numpy()[:count] if geometry.has_normals else np.full_like(ids, -1)
        self._memory, fields = filled(ids + 1, normal_ids + 1)
        self.triangle_vertex_ids, self.triangle_normal_ids = fields


@ti.data_oriented
class CourseRays:
    """The intersector of a scene, with triangles from 1."""

    def __init__(self, intersector: Any, geometry: Any) -> None:
        self.package, self.geometry = intersector, geometry

    @ti.func
    def query_ray(self, ray):
        """The nearest hit."""
        return shifted(self.package.query_segment(ray, 0.0, tm.inf), 1, HitData())

    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        """The hit on one triangle."""
        return shifted(self.package.intersect_triangle(ray, triangle_id - 1), 1, HitData())


class FromOne:
    """A field of ids, counted from 1; also in kernels."""

    def __init__(self, ids: Any) -> None:
        self.ids = ids

    def __getitem__(self, index: Any) -> Any:
        return (element(self.ids, index) if inside_kernel() else self.ids[index]) + 1


@ti.data_oriented
class CourseLights(OfPackage):
    """A sampler of lamps, with triangles from 1.

    Attributes:
        emissive_triangle_ids: the ids of the triangles whose material has Ke > 0.
        total_emissive_area: the sum of their areas, as ``total_emissive_area[None]``.
    """

    has_emissive_triangles = True

    def __init__(self, sampler: Any, scene: Any) -> None:
        super().__init__(sampler)
        self.geometry, self.material_library = scene.geometry, scene.material_library

    @cached_property
    def emissive_triangle_ids(self) -> Any:
        return FromOne(self.package.emissive_triangle_ids)

    @cached_property
    def total_emissive_area(self) -> Any:
        return held(float(self.package.total_area), lambda _area: None)

    @ti.func
    def sample_mesh_lights(self, hit_point):
        """(w_i, the triangle)."""
        w_i, triangle_id = call_with_known_args(self.package.sample_mesh_lights, hit_point)
        return w_i, triangle_id + 1

    @ti.func
    def sample_emissive_triangle(self):
        """Which of the emissive triangles, from 0."""
        return call_with_known_args(self.package.sample_emissive_triangle)

    @ti.func
    def evaluate_probability(self):
        """The density of the point, per area."""
        return call_with_known_args(self.package.evaluate_probability)


class CourseScene(OfPackage):
    """The package's scene: see the classes above. A scene without an environment has a black one."""

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.geometry = CourseGeometry(scene.geometry)
        self.ray_intersector = CourseRays(scene.ray_intersector, self.geometry)
        given = scene.environment
        self.environment = Environment(np.zeros((1, 1, 3)), name="black") if given is None else given
        nothing = {"geometry": self.geometry, "material_library": scene.material_library}
        self.mesh_light_sampler: Any = SimpleNamespace(has_emissive_triangles=False, **nothing)
        if scene.lamps.count > 0 and isinstance(scene.lamps.choice, MeshLightSampler):
            scene.lamps.prepare()
            self.mesh_light_sampler = CourseLights(scene.lamps.choice, self)


# ── samples of an environment, counted (A3-6) ──


@ti.data_oriented
class EnvISRenderer:
    """Counts the samples of a scene's environment in each pixel of a picture of it.

    Args:
        scene_data: a scene with an environment. width, height: size of the picture in pixels.

    Attributes:
        background: field [x, y] of RGB vectors, with y up: the environment, after ``render_background``.
        count_map: field [x, y]: how many samples fell into each pixel.
        samples: how many there are in all.
    """

    SampleMode = IntEnum("SampleMode", "UNIFORM ENVMAP")  # one density, or in proportion to the light

    def __init__(self, width: int, height: int, scene_data: SceneData) -> None:
        if scene_data.environment is None:
            raise InputError("EnvISRenderer needs a scene with an environment, such as environment='studio'")
        self.scene_data, self.environment, self.width, self.height = scene_data, scene_data.environment, width, height
        self.light = EnvironmentLight(self.environment, scene_data.effects)
        self.light.prepare()
        self.sampler = IndependentSampler()
        self.samples, self.mode = 0, self.SampleMode.UNIFORM
        zeros = np.zeros((width, height, 3))
        self._memory, (self.background, self.count_map) = filled(zeros, zeros[..., 0], indices=2)

    @property
    def sample_mode(self) -> Any:
        """The mode, as ``sample_mode[None]``."""
        return held(int(self.mode), self._use)

    def _use(self, mode: int) -> None:
        self.mode = self.SampleMode(mode)
        self.reset()

    def set_sample_uniform(self) -> None:
        """Draw points of the image with one density; the counts begin again."""
        self._use(self.SampleMode.UNIFORM)

    def set_sample_envmap(self) -> None:
        """Draw points in proportion to the light that arrives from them; the counts begin again."""
        self._use(self.SampleMode.ENVMAP)

    def reset(self) -> None:
        """Begin to count again."""
        self._memory.write(self.count_map, np.zeros((self.width, self.height)))
        self.samples = 0

    def render_background(self) -> None:
        """Write the environment into ``background``."""
        x, y = np.arange(self.width), np.arange(self.height)
        columns = ((x + 0.5) / self.width * self.environment.x_resolution).astype(int)
        rows = ((1 - (y + 0.5) / self.height) * self.environment.y_resolution).astype(int)
        radiance = self.environment.pixels[rows[None], columns[:, None]] * self.environment.intensity
        self._memory.write(self.background, radiance)

    def sample_env(self, samples: int = 1) -> None:
        """Add so many samples to ``count_map``."""
        if not samples >= 1:
            raise InputError(f"EnvISRenderer: samples must be at least 1, not {samples!r}")
        self._count(int(samples), self.samples, self.mode == self.SampleMode.ENVMAP)
        self.samples += int(samples)

    @ti.kernel
    def _count(self, samples: ti.i32, first: ti.u32, follows_light: ti.template()):
        for i in range(samples):
            xi = self.sampler.start(ti.u32(0), 0, 0, first + ti.cast(i, ti.u32)).next_2d()
            u, v = xi.x, xi.y
            if ti.static(follows_light):
                _, _, turned, height = self.light.find_texel(xi)
                u = turned - self.environment.settings[0, 1]  # the image does not have the rotation of the environment
                v = 0.5 + tm.asin(tm.clamp(height, -1, 1)) / tm.pi
            x = ti.min(ti.cast(u * self.width, ti.i32), self.width - 1)
            y = ti.min(ti.cast(v * self.height, ti.i32), self.height - 1)
            self.count_map[x, y] += 1
