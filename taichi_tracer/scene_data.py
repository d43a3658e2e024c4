"""A scene: geometry, materials, lights and an intersector; and queries about single rays from Python."""

import copy
import functools
import hashlib
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import taichi as ti
import taichi.math as tm
from numpy.typing import ArrayLike

from taichi_tracer.background import Background, load_background
from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.brdfs.surface import Surface, surface_at
from taichi_tracer.effects import MODES, Effects, derive
from taichi_tracer.environment import Environment, load_environment
from taichi_tracer.files.arrays import dressed, mesh_from_arrays
from taichi_tracer.forms import Form, intersector_of
from taichi_tracer.formulas.camera_frame import up_of, view_of_points
from taichi_tracer.formulas.convexity import sides_that_see_others
from taichi_tracer.formulas.triangles import TriangleTest
from taichi_tracer.geometry import Geometry, Mesh, check, clean, smoothed, visible_points
from taichi_tracer.lights.base import Light
from taichi_tracer.lights.choice import LampChoice
from taichi_tracer.lights.environment_light import EnvironmentLight
from taichi_tracer.lights.lamps import Lamps
from taichi_tracer.lights.scene_lights import SceneLights, is_blocked, may_meet
from taichi_tracer.materials import Material, MaterialLibrary
from taichi_tracer.ray import Ray, no_hit
from taichi_tracer.ray_intersector import RayIntersector
from taichi_tracer.sampler import BRDF, MeshLightSampler
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.digits import digits, digits_of
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.recent import Recent
from taichi_tracer.system.registry import PARTS
from taichi_tracer.system.reuse import Reused
from taichi_tracer.system.seams import in_kernels, replaced
from taichi_tracer.system.stopwatch import BUILD, LIGHTS, part

# Hexadecimal digits of a fingerprint: 128 bits, so that two different scenes practically never share one.
FINGERPRINT_DIGITS = 32
FEW_LAMPS = 64  # up to so many, a choice by power alone takes less time than it loses to a hierarchy
KEPT_FORMS = 8  # of a scene: with so many different lights, going back to an earlier one compiles nothing
ROWS_SHOWN = 20  # of a table of hits in a notebook

# What the parameters of a scene may be; ``SceneData`` says what each means.
IntersectorChoice = str | type[RayIntersector] | RayIntersector
BrdfChoice = str | Brdf | type[Brdf]
LightChoice = str | Light | type[Light]
LampChoices = str | LampChoice | type[LampChoice]
EnvironmentChoice = ArrayLike | Path | Environment | None
BackgroundChoice = ArrayLike | Path | Background | None


class RayHit(NamedTuple):
    """What one ray hit: a row of ``RayHits``, with the same members."""

    is_hit: bool
    distance: float
    triangle_id: int
    barycentric_coords: np.ndarray
    normal: np.ndarray
    geometric_normal: np.ndarray
    material_id: int
    is_backfacing: bool
    position: np.ndarray


@dataclass
class RayHits:
    """The result of ``SceneData.intersect``: arrays with one row per ray. The members are those of ``HitData``.

    ``hits[i]`` and iteration give a ``RayHit`` for each ray. ``hits[hits.is_hit]``, or another mask, list of numbers or
    slice, gives the ``RayHits`` of some of the rays.
    """

    is_hit: np.ndarray
    distance: np.ndarray
    triangle_id: np.ndarray
    barycentric_coords: np.ndarray
    normal: np.ndarray
    geometric_normal: np.ndarray
    material_id: np.ndarray
    is_backfacing: np.ndarray
    position: np.ndarray

    @classmethod
    def of_memory(cls, n: int, dtype: type[np.floating], reused: Reused) -> "RayHits":
        """Arrays without values for n rays; the flags are int32.

        They are parts of one array, because only the memory of large arrays is reused. Without that, the system would
        take a sixth of the time of ``intersect`` to hand out the memory for a million rays.
        """
        reals = {"distance": 1, "barycentric_coords": 2, "normal": 3, "geometric_normal": 3, "position": 3}
        memory = reused.empty(n * (12 * np.dtype(dtype).itemsize + 4 * 4))
        arrays, at = {}, 0
        for name in (*reals, "is_hit", "triangle_id", "material_id", "is_backfacing"):
            kind, width = (np.dtype(dtype), reals[name]) if name in reals else (np.dtype(np.int32), 1)
            end = at + n * width * kind.itemsize
            part = memory[at:end].view(kind)
            arrays[name] = part if width == 1 else part.reshape(n, width)
            at = end
        return cls(**arrays)

    def __len__(self) -> int:
        return len(self.is_hit)

    def __getitem__(self, which) -> "RayHit | RayHits":
        rows = {f.name: getattr(self, f.name)[which] for f in fields(self)}
        return RayHit(**rows) if np.ndim(rows["is_hit"]) == 0 else RayHits(**rows)

    def __iter__(self) -> Iterator[RayHit]:
        return map(RayHit._make, zip(*(getattr(self, f.name) for f in fields(self)), strict=True))

    @property
    def points(self) -> np.ndarray:
        """(n, 3) ``position``, with NaN instead of 0 for the rays that hit nothing."""
        return np.where(self.is_hit[:, None], self.position, np.nan).astype(self.position.dtype)

    def to_dict(self) -> dict[str, np.ndarray]:
        """Name → (n,) array, one for each component: is_hit, …, normal_x, normal_y, normal_z, …

        ``pandas.DataFrame(hits.to_dict())`` is a table with one row per ray. The two components of
        ``barycentric_coords`` have the names u and v.
        """
        columns = {}
        for f in fields(self):
            values = getattr(self, f.name)
            if values.ndim == 1:
                columns[f.name] = values
            else:
                letters = "uv" if values.shape[1] == 2 else "xyz"
                columns |= {f"{f.name}_{letter}": values[:, k] for k, letter in enumerate(letters)}
        return columns

    def __repr__(self) -> str:
        return f"RayHits({len(self):,} rays, {int(self.is_hit.sum()):,} hits)"

    def _repr_html_(self, most: int = ROWS_SHOWN) -> str:
        """The first rows as an HTML table, for notebooks."""
        names = [f.name for f in fields(self)]
        head = "".join(f"<th>{name}</th>" for name in ["ray", *names])
        rows = "".join(
            f"<tr><td>{i}</td>" + "".join(f"<td>{_cell(getattr(self, name)[i])}</td>" for name in names) + "</tr>"
            for i in range(min(most, len(self)))
        )
        rest = f"<p>… and {len(self) - most:,} more rays</p>" if len(self) > most else ""
        summary = f"<p>{len(self):,} rays, {int(self.is_hit.sum()):,} hits</p>"
        return f"{summary}<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{rest}"


def _cell(value: Any) -> str:
    if np.ndim(value) > 0:
        return digits_of(value, ".4g")
    if isinstance(value, np.bool_):
        return "yes" if value else "no"
    return digits(float(value), ".6g")


@ti.data_oriented
class SceneInKernels:
    """The part of a scene that kernels use, compiled for its effects. After a change of the scene, it is another one.

    Attributes:
        geometry, ray_intersector, material_library, environment, background: those of ``SceneData``.
        lights: all lights, see ``lights.scene_lights``.
        effects: what is compiled, see ``effects.Effects``.
        compensates: whether samples of the environment leave out what samples of the BRDF find, see
            ``lights.environment_light``.
    """

    def __init__(self, scene: "SceneData", effects: Effects, compensates: bool = False) -> None:
        self.effects, self.compensates = effects, compensates
        self.geometry, self.ray_intersector = scene.geometry, scene.ray_intersector
        self.material_library = scene.material_library
        self.environment, self.background = scene.environment, scene.background
        far: list[Light] = []
        if scene.environment is not None and effects.environment in ("constant", "image"):
            far = [EnvironmentLight(scene.environment, effects, scene.up_axis, compensates)]
        lamps = scene.lamps if effects.emitters else None
        self.lights = SceneLights([*far, *scene.lights], effects, lamps)

    @in_kernels
    def surface_at(self, ray, hit) -> Surface:
        """The surface that a ray hit."""
        return surface_at(self, ray, hit)

    @ti.func
    def emitted(self, ray, hit, rng):
        """Radiance along a ray without any reflection: from an emitting surface, or from behind the scene."""
        L = tm.vec3(0)
        if hit.is_hit:
            if ti.static(self.effects.emitters):
                L = self.lights.lamps.emitted(hit)
        else:
            L = self.behind(ray, hit, rng)
        return L

    @ti.func
    def behind(self, ray, hit, rng):
        """What a ray shows if it hits nothing: the background of the picture, or the lights that it sees."""
        value = tm.vec3(0)
        if ti.static(self.effects.background):
            value = self.background.color(rng.x, rng.y, rng.sampler.width, rng.sampler.height)
        else:
            value = self.lights.arriving(ray, hit)
            for light in ti.static(self.lights.single):
                value += light.radiance(ray, hit)
        return value

    @ti.func
    def visible_radiance(self, surface, w_i, factor):
        """Radiance that arrives at a surface from w_i; 0 if something blocks it.

        The caller multiplies the result by ``factor``. If ``factor`` is 0, no light is looked up and no ray is sent.
        """
        light, _ = self.lights.visible(self, surface, w_i, factor)
        return light

    @ti.func
    def is_blocked(self, surface, w_i, distance):
        """Whether anything lies between a surface and a light in the direction w_i."""
        return is_blocked(self.effects, self.ray_intersector, surface, w_i, distance)

    @ti.func
    def met(self, surface, ray):
        """HitData of what a ray hits that leaves a surface; if it can hit nothing, it is not traced."""
        hit = no_hit()
        if ti.static(self.effects.blockers != "none"):
            if may_meet(self.effects, surface, ray.direction):
                hit = self.ray_intersector.query_segment(ray, 0.0, tm.inf)
        return hit


@ti.data_oriented
class SceneData:
    """Everything that rays can hit. The memory is freed together with the object, or by ``destroy``.

    Args:
        mesh: triangles, spheres and materials.
        intersector: the name of a registered intersector, a class that derives from ``RayIntersector``, or an object of
            such a class that has no geometry yet.
        triangle_test: the name of a registered triangle test, or a ``TriangleTest``.
        view: camera parameters that show the scene, as for ``camera.make_camera``. With None, they are computed: a
            three-quarter view from above, which shows everything.
        environment: light from far away: a shipped name, the path of an image, an (h, w, 3) array, an
            ``Environment``, or None.
        effects: "scene" compiles the effects that the scene calls for; "all" compiles every effect, for comparison.
        background: what stands behind everything in a picture: a ``Background``, a colour, or None.
        brdfs: BRDFs, by name or as objects. They take precedence over the registered BRDFs.
        lights: lights other than the environment, by name or as objects.
        fast: False runs only the plain forms, which a student reads. They are slower and give the same bits.
        smooth: whether corners without a normal get a smooth one; or the angle in degrees from which an edge stays
            sharp, see ``geometry.smoothed``. True is 30 degrees.
        up_axis: the axis that points upwards in the scene, "y" or "z". The computed view has this axis upright, and the
            zenith of the environment is in this direction. The coordinates of the scene stay as they are.
        lamp_choice: how a sample of the light chooses among the surfaces with Ke > 0: the name of a registered
            ``LampChoice``, or one: "area", "power" or "hierarchy". None takes "power" for up to 64 of them, and
            "hierarchy" for more.
        two_sided_lamps: whether triangles with Ke > 0 emit from both sides; if not, from their front only (A3-1).

    Attributes:
        effects: the effects for which rendering is compiled, see ``effects.Effects``.
        version: counts changes, so that a renderer knows when its samples belong to an older scene.
        geometry, material_library, ray_intersector: see their classes.
        view: camera parameters that show the scene.
        shots: the pictures that the scene's file asks for, see ``rt3.document``; a mesh has none.
        notes: what the user should know about the input, one line each.
        forms: which form of the intersector runs, and why; see ``forms``.
    """

    from_python = RayIntersector.from_python

    def __init__(
        self,
        mesh: Mesh,
        intersector: IntersectorChoice = "bvh",
        triangle_test: str | TriangleTest = "watertight",
        view: dict[str, Any] | None = None,
        environment: EnvironmentChoice = None,
        effects: str = "scene",
        background: BackgroundChoice = None,
        brdfs: Sequence[BrdfChoice] = (),
        lights: Sequence[LightChoice] = (),
        fast: bool = True,
        smooth: bool | float = False,
        up_axis: str = "y",
        lamp_choice: LampChoices | None = None,
        two_sided_lamps: bool = False,
    ) -> None:
        up_of(up_axis)  # raises the error for an unknown name before anything is made
        chosen = PARTS.find("intersector", intersector)
        runtime.ensure()
        check(mesh)
        mesh = clean(smoothed(mesh, smooth), runtime.dtype())
        self.mesh, self.source, self.notes, self.dropped = mesh, mesh.source, mesh.notes, mesh.dropped
        if mesh.dropped > 0:
            warnings.warn(mesh.notes[-1], stacklevel=3)  # the caller of load_scene_data or scene_from_mesh
        self.effects_mode, self.fast, self.version = effects, bool(fast), 0
        self.shots: tuple = ()
        self.up_axis, self.smooth = up_axis, smooth
        if effects not in MODES:
            raise one_of("effects", effects, MODES)
        self.lights: list[Light] = [PARTS.find("light", light) for light in lights]
        self.environment, self.background = load_environment(environment), load_background(background)

        self._blockers = blockers_of(mesh, chosen, triangle_test)
        self._memory = memory.Memory()
        with self._memory as builder:
            self.material_library = MaterialLibrary(mesh.materials, brdfs_of(brdfs), builder)
            self.effects = self._derived()
            is_students = bool(replaced(chosen))
            self.geometry = Geometry(mesh, self.effects, builder, completes_normals=is_students)
        self.geometry.load(self._memory, self.material_library.tables())
        with part(BUILD, waits=True):
            self.ray_intersector, form = make_intersector(chosen, self.geometry, triangle_test, self.fast)
        self.forms = (form,)
        with part(LIGHTS):
            self.lamps = Lamps(self.geometry, self.material_library, lamp_choice_of(lamp_choice, mesh), two_sided_lamps)
        self.view = view_of_points(visible_points(mesh), up_axis) if view is None else dict(view)
        self._computed_view = self.view if view is None else None
        self._in_kernels = Recent(KEPT_FORMS)
        self._reused = Reused()  # the memory of the results of ``intersect``

    def view_for(self, aspect: float) -> dict[str, Any]:
        """``view`` for a picture with this width / height: a computed view of a high picture is from farther away."""
        if self.view is not self._computed_view or aspect >= 1:
            return self.view
        return view_of_points(visible_points(self.mesh), self.up_axis, aspect=aspect)

    def set_environment(self, environment: EnvironmentChoice) -> None:
        """Replace the light from far away. The argument may be anything that the constructor takes."""
        self.environment = load_environment(environment)
        self._changed()

    def set_background(self, background: BackgroundChoice) -> None:
        """Replace the picture behind the scene. The argument may be anything that the constructor takes."""
        self.background = load_background(background)
        self._changed()

    def _derived(self) -> Effects:
        library = self.material_library
        rest = self.environment, self.background, self.lights, self.effects_mode
        return derive(self.mesh, library.brdfs, library.brdf_of, *rest, self._blockers)

    def _changed(self) -> None:
        self.effects = self.geometry.effects = self._derived()
        self.version += 1

    def in_kernels(self, effects: Effects | None = None, compensates: bool = False) -> SceneInKernels:
        """The part of the scene that kernels use.

        Args:
            effects: the effects to compile, for comparison; None takes those that the scene calls for.
            compensates: whether the integrator allows that samples of the environment leave out what samples of the
                BRDF find. They do so if the light depends on the direction, and if the BRDFs find all of it.
        """
        is_even = self.environment is None or self.environment.constant is not None
        compensates &= not is_even and self.material_library.reach_all(self.mesh.used_materials())
        if effects is not None:
            return SceneInKernels(self, effects, compensates)
        light = self.environment, self.background, *self.lights
        make = functools.partial(SceneInKernels, self, self.effects, compensates)
        return self._in_kernels.get((self.effects, light, compensates), make)

    def receipt(self) -> list[str]:
        """One line per effect and per form: what is simulated, which form runs, and why."""
        lines = [*self.effects.receipt(), *(str(form) for form in self.forms)]
        if self.lamps.count > 0:
            lines.append(f"{'lamp choice':<15} {self.lamps.choice.name}: one of {self.lamps.count:,} for each sample")
        return lines

    def fingerprint(self) -> str:
        """A hash of everything in the scene on which a picture depends."""
        mesh, sky = self.mesh, self.environment
        digest = hashlib.sha256(described(mesh.materials).encode())
        arrays: list = [mesh.vertices, mesh.faces, mesh.face_materials, mesh.normals, mesh.face_normals]
        arrays += [mesh.spheres, mesh.sphere_ids, mesh.sphere_materials]
        if mesh.face_culls is not None:
            arrays.append(mesh.face_culls)
        if self.up_axis != "y":
            digest.update(self.up_axis.encode())
        if self.background is not None:
            arrays += [self.background.pixels, np.array([self.background.corners])]
        if sky is not None:
            arrays += [sky.pixels, np.array([sky.intensity, sky.rotation])]
            digest.update(sky.lookup.encode())
        for light in self.lights:
            digest.update(repr((light.name, light.facts())).encode())
        if self.lamps.count > 0:
            digest.update(repr((self.lamps.choice.name, self.lamps.two_sided)).encode())
        for array in arrays:
            digest.update(f"{array.shape} {array.dtype}".encode())
            digest.update(np.ascontiguousarray(array).data)
        return digest.hexdigest()[:FINGERPRINT_DIGITS]

    @property
    def num_triangles(self) -> int:
        """The number of triangles, including those that no ray can hit."""
        return self.geometry.n_triangles

    @property
    def num_spheres(self) -> int:
        """The number of spheres."""
        return self.geometry.n_spheres

    @property
    def materials(self) -> list[Material]:
        """The ``Material`` of every material id."""
        return self.material_library.materials

    def check_alive(self) -> None:
        """Raise a StaleSceneError if Taichi was initialised again after the scene was made."""
        self._memory.check("scene")

    def destroy(self) -> None:
        """Free the scene's memory now; it cannot be used afterwards."""
        self._memory.free()
        self._reused = Reused()
        self.ray_intersector.destroy()

    @ti.func
    def query_ray(self, ray):
        """HitData of the nearest hit of one ray, for kernels; Python calls ``intersect`` with any number of rays."""
        return self.ray_intersector.query_ray(ray)

    def intersect(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> RayHits:
        """The nearest hit of every ray with t_min < t < t_max.

        Args:
            origins, directions: (N, 3) or (3,) arrays. A direction may have any length except 0; ``distance`` is in
                units of this length. Rays with NaN, with infinity or with a zero direction miss everything.
            t_min, t_max: one number for all rays, or an (N,) array with one number per ray.
        """
        rays = self._as_rays(origins, directions, t_min, t_max)
        n = len(rays[0])
        hits = RayHits.of_memory(n, runtime.dtype(), self._reused)
        if n > 0:
            self._intersect(*rays, *(getattr(hits, f.name) for f in fields(hits)))
        hits.is_hit = hits.is_hit.astype(bool)
        hits.is_backfacing = hits.is_backfacing.astype(bool)
        return hits

    def occluded(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> np.ndarray:
        """(N,) bool: whether the ray hits anything with t_min < t < t_max. Arguments as for ``intersect``."""
        rays = self._as_rays(origins, directions, t_min, t_max)
        blocked = np.empty(len(rays[0]), np.int32)
        if len(blocked) > 0:
            self._occluded(*rays, blocked)
        return blocked.astype(bool)

    def _as_rays(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike, t_max: ArrayLike
    ) -> tuple[np.ndarray, ...]:
        """Contiguous (N, 3), (N, 3), (N,), (N,) arrays in the running precision; single values are repeated N times."""
        self.check_alive()
        dtype = runtime.dtype()
        arrays = []
        for name, value in (("origins", origins), ("directions", directions)):
            array = np.asarray(value, dtype=dtype)
            if array.ndim == 1 and array.size == 0:
                array = array.reshape(0, 3)
            if array.ndim not in (1, 2) or array.shape[-1] != 3:
                raise InputError(f"intersect: {name} must have the shape (n, 3), not {array.shape}")
            arrays.append(array.reshape(-1, 3))
        try:
            n = np.broadcast_shapes(*(a.shape[:1] for a in arrays), np.shape(t_min), np.shape(t_max))[0]
            o, d = (np.ascontiguousarray(np.broadcast_to(a, (n, 3))) for a in arrays)
            lo, hi = (np.ascontiguousarray(np.broadcast_to(np.asarray(t, dtype), (n,))) for t in (t_min, t_max))
        except ValueError:
            shapes = ", ".join(str(np.shape(a)) for a in (origins, directions, t_min, t_max))
            raise InputError(f"intersect: origins, directions, t_min, t_max do not fit together: {shapes}") from None
        return o, d, lo, hi

    @ti.kernel
    def _intersect(
        self,
        origins: ti.types.ndarray(ndim=2),
        directions: ti.types.ndarray(ndim=2),
        t_min: ti.types.ndarray(ndim=1),
        t_max: ti.types.ndarray(ndim=1),
        is_hit: ti.types.ndarray(ndim=1),
        distance: ti.types.ndarray(ndim=1),
        triangle_id: ti.types.ndarray(ndim=1),
        barycentric_coords: ti.types.ndarray(ndim=2),
        normal: ti.types.ndarray(ndim=2),
        geometric_normal: ti.types.ndarray(ndim=2),
        material_id: ti.types.ndarray(ndim=1),
        is_backfacing: ti.types.ndarray(ndim=1),
        position: ti.types.ndarray(ndim=2),
    ):
        for i in range(origins.shape[0]):
            ray = ray_from(origins, directions, i)
            data = self.ray_intersector.query_segment(ray, t_min[i], t_max[i])
            is_hit[i] = data.is_hit
            distance[i] = data.distance
            triangle_id[i] = data.triangle_id
            material_id[i] = data.material_id
            is_backfacing[i] = data.is_backfacing
            for k in ti.static(range(2)):
                barycentric_coords[i, k] = data.barycentric_coords[k]
            for k in ti.static(range(3)):
                normal[i, k] = data.normal[k]
                geometric_normal[i, k] = data.geometric_normal[k]
                position[i, k] = data.position[k]

    @ti.kernel
    def _occluded(
        self,
        origins: ti.types.ndarray(ndim=2),
        directions: ti.types.ndarray(ndim=2),
        t_min: ti.types.ndarray(ndim=1),
        t_max: ti.types.ndarray(ndim=1),
        blocked: ti.types.ndarray(ndim=1),
    ):
        for i in range(origins.shape[0]):
            ray = ray_from(origins, directions, i)
            blocked[i] = self.ray_intersector.is_blocked(ray, t_min[i], t_max[i])

    def __repr__(self) -> str:
        spheres = f"{self.num_spheres:,} spheres, " if self.num_spheres > 0 else ""
        return (
            f"SceneData({self.source!r}: {self.num_triangles:,} triangles, {spheres}{len(self.materials)} materials, "
            f"{self.ray_intersector.name}, {self.ray_intersector.triangle_test})"
        )


def again(former: SceneData, **changes: Any) -> SceneData:
    """A new scene with the primitives and parts of another one, except for some arguments of ``SceneData``."""
    intersector = type(former.ray_intersector)
    own = {
        "intersector": getattr(intersector, "stands_in_for", intersector),
        "triangle_test": former.ray_intersector.triangle_test,
        "view": None if former.view is former._computed_view else former.view,
        "environment": former.environment,
        "effects": former.effects_mode,
        "background": former.background,
        "brdfs": list(reversed(former.material_library.brdfs)),  # the last one of the library is asked first
        "lights": former.lights,
        "fast": former.fast,
        "up_axis": former.up_axis,
        "lamp_choice": former.lamps.choice,
        "two_sided_lamps": former.lamps.two_sided,
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the primitives that are dropped were told when this scene was made
        scene = SceneData(former.mesh, **own | changes)
    scene.shots, scene.notes = former.shots, former.notes
    return scene


def described(materials: list[Material]) -> str:
    """All members of all materials as text, for the fingerprint: checkpoints keep it, so that it must not change."""
    words = ["Material(" + ", ".join(f"{f.name}={getattr(m, f.name)!r}" for f in fields(m)) + ")" for m in materials]
    return f"[{', '.join(words)}]"


def blockers_of(mesh: Mesh, intersector, triangle_test: str | TriangleTest) -> str:
    """What a ray that leaves a surface can hit, see ``Effects``. A student's code may find more: it is always asked."""
    test = PARTS.find("triangle test", triangle_test)
    if replaced(intersector) or not test.solve.__module__.startswith("taichi_tracer."):
        return "all"
    if len(mesh.spheres) > 0:
        return "backs" if len(mesh.spheres) == 1 and len(mesh.faces) == 0 else "all"
    return sides_that_see_others(mesh.vertices, mesh.faces)


def lamp_choice_of(chosen: LampChoices | None, mesh: Mesh) -> LampChoice:
    """A lamp choice of a scene's own, because its tables belong to the scene; None asks for one that suits the mesh.

    If a method of ``MeshLightSampler`` is replaced, it takes the place of "area", and of a choice that is not given.
    """
    if replaced(MeshLightSampler) and chosen in (None, "area"):
        return MeshLightSampler()
    usual = "power" if mesh.emits().sum() <= FEW_LAMPS else "hierarchy"
    return copy.copy(PARTS.find("lamp choice", usual if chosen is None else chosen))


def brdfs_of(chosen: Sequence[BrdfChoice]) -> list[Brdf]:
    """The BRDFs that a scene knows. If several of them describe a material, the last one in this list is used.

    The order is: the registered BRDFs in the order of their registration; then the ``BRDF`` of the handout, if one of
    its methods was replaced; then the BRDFs that were chosen for this scene, in reverse order.
    """
    own = [PARTS.find("BRDF", one) for one in chosen]
    handouts = [BRDF()] if replaced(BRDF) else []
    return [*(brdf for brdf in PARTS.all("BRDF") if brdf not in own), *handouts, *reversed(own)]


def make_intersector(
    chosen: type[RayIntersector] | RayIntersector, geometry: Geometry, triangle_test: str | TriangleTest, fast: bool
) -> tuple[RayIntersector, Form]:
    """The intersector of a geometry, made from a class or from an object without a geometry, and its ``Form``."""
    if not isinstance(chosen, type):
        if chosen.geometry is not None:
            raise InputError(f"intersector: this {type(chosen).__name__} belongs to another scene: make a new one")
        chosen.bind(geometry, triangle_test)
        return chosen, Form("rays", f"{type(chosen).__name__}, as it is written", "it was given as an object")
    runs, form = intersector_of(chosen, fast)
    return runs(geometry, triangle_test), form


@ti.func
def ray_from(origins: ti.template(), directions: ti.template(), i):
    """Row i of two (N, 3) arrays as a ray."""
    return Ray(
        origin=tm.vec3(origins[i, 0], origins[i, 1], origins[i, 2]),
        direction=tm.vec3(directions[i, 0], directions[i, 1], directions[i, 2]),
    )


def scene_from_mesh(
    vertices: Any,
    faces: ArrayLike | None = None,
    *,
    color: ArrayLike | None = None,
    material: Material | Sequence[Material] | None = None,
    normals: ArrayLike | None = None,
    face_materials: ArrayLike | None = None,
    intersector: IntersectorChoice = "bvh",
    triangle_test: str | TriangleTest = "watertight",
    view: dict[str, Any] | None = None,
    environment: EnvironmentChoice = None,
    effects: str = "scene",
    background: BackgroundChoice = None,
    brdfs: Sequence[BrdfChoice] = (),
    lights: Sequence[LightChoice] = (),
    fast: bool = True,
    smooth: bool | float = False,
    up_axis: str = "y",
    lamp_choice: LampChoices | None = None,
    two_sided_lamps: bool = False,
) -> SceneData:
    """A scene from arrays, or from a ``trimesh.Trimesh`` or ``trimesh.Scene``.

    Args:
        vertices: (V, 3) float positions, or the trimesh object.
        faces: (F, 3) int vertex ids, counted from 0, counter-clockwise when seen from the front.
        color: the reflectance Kd of a diffuse material, three numbers from 0 to 1, linear RGB; or (M, 3), one row for
            each of several materials. None, without a ``material``, is a light grey, or what the trimesh object has.
        material: a ``Material`` instead of a colour, or a list of several.
        normals: (V, 3), a normal for each vertex, or (F, 3, 3), a normal for each corner of each triangle. They need
            not have unit length. Without them, triangles are flat; ``smooth=True`` computes normals.
        face_materials: (F,) ids into the colours or materials, counted from 0, one for each triangle.
        intersector, triangle_test, view, environment, effects, background, brdfs, lights, fast, smooth, up_axis,
            lamp_choice, two_sided_lamps: as for ``SceneData``.

    Raises:
        InputError: an array has the wrong shape or a value out of range; the message has the name and the value.
    """
    if faces is None:
        from taichi_tracer.files.meshes import from_trimesh

        mesh = from_trimesh(vertices)
    else:
        mesh = mesh_from_arrays(vertices, faces)
    return SceneData(
        dressed(mesh, color, material, normals, face_materials),
        intersector=intersector,
        triangle_test=triangle_test,
        view=view,
        environment=environment,
        effects=effects,
        background=background,
        brdfs=brdfs,
        lights=lights,
        fast=fast,
        smooth=smooth,
        up_axis=up_axis,
        lamp_choice=lamp_choice,
        two_sided_lamps=two_sided_lamps,
    )
