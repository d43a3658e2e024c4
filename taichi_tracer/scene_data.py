"""A scene: geometry, materials, lights and an intersector; and queries about single rays from Python."""

import warnings
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike

from taichi_tracer.effects import Effects, derive
from taichi_tracer.environment import load_background, load_environment
from taichi_tracer.formulas.view import up_of
from taichi_tracer.geometry import Geometry, Mesh, check, clean
from taichi_tracer.instances import on_ground, resolve_instances, view_of_mesh
from taichi_tracer.integrators.scene_in_kernels import SceneInKernels
from taichi_tracer.intersectors.instances import Places
from taichi_tracer.lights.lamps import Lamps
from taichi_tracer.materials import Material, MaterialLibrary, Textures
from taichi_tracer.options import (
    SCENE_DEFAULTS,
    BackgroundChoice,
    EnvironmentChoice,
    SceneOptions,
    all_options,
    blockers_of,
    brdfs_of,
    intersector_of,
    knows_instances,
    lamp_choice_of,
    lights_of,
    make_intersector,
    with_options,
)
from taichi_tracer.ray import RayHits, as_rays, ray_from, write_hit
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.compile_time import one_at_a_time
from taichi_tracer.system.parts import PARTS, KnownAttributes, replaced, why_replaced
from taichi_tracer.system.stopwatch import BUILD, LIGHTS, stage

if TYPE_CHECKING:
    from typing_extensions import Unpack

KEPT_FORMS = 8  # of a scene: with so many different lights, going back to an earlier one compiles nothing


@ti.data_oriented
class SceneData(KnownAttributes):
    """Everything that rays can hit. The memory is freed together with the object, or by ``destroy``.

    Args:
        mesh: triangles, spheres and materials.
        options: see ``options.SceneOptions``.

    Attributes:
        effects: the effects for which rendering is compiled, see ``effects.Effects``.
        version: counts changes, so that a renderer knows when its samples belong to an older scene.
        num_triangles, num_spheres: how many there are in all places, including those that no ray can hit.
        geometry, material_library, ray_intersector: see their classes.
        view: camera parameters that show the scene.
        shots: the pictures that the scene's file asks for, see ``rt3.document``; a mesh has none.
        is_light_open: whether nobody has said which light comes from far away; then ``A2Renderer`` and those like it
            light a scene without any light by ``USUAL_LIGHT``.
        lights_of_file: how many of ``lights`` are from there; they are the first ones.
        notes: what the user should know about the input, one line each.
        given_mesh, given: the arguments of which it was made, with the defaults of the options.
    """

    @one_at_a_time
    @with_options(SceneOptions, SCENE_DEFAULTS)
    def __init__(self, mesh: "Mesh", **options: "Unpack[SceneOptions]") -> None:
        self.given_mesh, self.given = mesh, all_options("SceneData", options, SCENE_DEFAULTS)
        given = self.given
        chosen_test, up_axis, view = given["triangle_test"], given["up_axis"], given["view"]
        up_of(up_axis)  # raises the error for an unknown name before anything is made
        runtime.ensure()
        check(mesh)
        copies = given["instances"] if knows_instances(given["intersector"]) else "copied"
        mesh = on_ground(mesh, up_axis) if given["ground"] else mesh
        mesh = clean(resolve_instances(mesh, given["smooth"], copies), runtime.dtype())
        chosen = intersector_of(given["intersector"], mesh)
        self.mesh, self.source, self.notes, self.dropped = mesh, mesh.source, mesh.notes, mesh.dropped
        if mesh.dropped > 0:
            warnings.warn(mesh.notes[-1], stacklevel=4)  # the caller of load_scene_data or scene_from_mesh
        self.effects_mode, self.version = given["effects"], 0
        placed = mesh.placed
        self.num_triangles = len(mesh.faces) if placed is None else placed.total(placed.faces)
        self.num_spheres = len(mesh.spheres) if placed is None else placed.total(placed.spheres)
        self.shots: tuple = ()
        self.lights_of_file = len(mesh.lights)
        self.up_axis, self.ground = up_axis, given["ground"]
        self.chosen = chosen if isinstance(chosen, type) else type(chosen)
        self.lights = [*lights_of(mesh), *(PARTS.find("light", light) for light in given["lights"])]
        self._environment, self.is_light_open = load_environment(given["environment"]), "environment" not in options
        self._background = load_background(given["background"])

        self._blockers = blockers_of(mesh, chosen, chosen_test)
        self.material_library = MaterialLibrary(mesh.materials, brdfs_of(given["brdfs"]))
        self.effects = derive(self, self._blockers)
        self.geometry = Geometry(mesh, self.effects, completes_normals=bool(replaced(chosen)))
        self._memories = [*self.geometry.memories, self.material_library.memory]
        if placed is not None:
            self.geometry.places = Places(placed, self.effects.spheres)
            self._memories.append(self.geometry.places.memory)
        if self.effects.textures:
            self.geometry.textures = Textures(mesh, self.geometry)
            self._memories += self.geometry.textures.memories
        with stage(BUILD, waits=True):
            self.ray_intersector = make_intersector(chosen, self.geometry, chosen_test)
        self.material_library.intersector = self.ray_intersector
        with stage(LIGHTS):
            choice = lamp_choice_of(given["lamp_choice"], mesh)
            self.lamps = Lamps(self.geometry, self.material_library, choice, given["two_sided_lamps"])
        self._view_of = view_of_mesh if view is None else view
        self.view = self._computed_view = self._view_of(mesh, up_axis) if callable(self._view_of) else dict(view or {})
        self._in_kernels: dict[Any, SceneInKernels] = {}

    @property
    def parts(self) -> tuple[Any, ...]:
        """The intersector, the BRDFs and the lights."""
        return self.ray_intersector, *self.material_library.brdfs, *self.lights

    def view_for(self, aspect: float) -> dict[str, Any]:
        """``view`` for a picture with this width / height: a computed view of a high picture is from farther away."""
        if self.view is not self._computed_view or not callable(self._view_of) or aspect >= 1:
            return self.view
        return self._view_of(self.mesh, self.up_axis, aspect)

    @property
    def environment(self) -> Any:
        """The light from far away, an ``Environment`` or None; it may be assigned, as to ``set_environment``."""
        return self._environment

    @environment.setter
    def environment(self, environment: EnvironmentChoice) -> None:
        """Replace the light from far away. The argument may be anything that the constructor takes."""
        self._environment, self.is_light_open = load_environment(environment), False
        self._changed()

    @property
    def background(self) -> Any:
        """What stands behind the scene, a ``Background`` or None; it may be assigned, as to ``set_background``."""
        return self._background

    @background.setter
    def background(self, background: BackgroundChoice) -> None:
        """Replace the picture behind the scene. The argument may be anything that the constructor takes."""
        self._background = load_background(background)
        self._changed()

    set_environment, set_background = environment.fset, background.fset  # type: ignore[attr-defined]

    def _changed(self) -> None:
        self.effects = self.geometry.effects = derive(self, self._blockers)
        self.version += 1

    def effects_for(self, microfacets: bool) -> Effects:
        """The effects for estimators that read the roughness, or Ns, of a material that has both."""
        is_other = microfacets and self.material_library.has_both_models
        return derive(self, self._blockers, microfacets=True) if is_other else self.effects

    def in_kernels(
        self, effects: Effects | None = None, compensates: bool = False, microfacets: bool = False
    ) -> SceneInKernels:
        """The part of the scene that kernels use.

        Args:
            effects: the effects to compile, for comparison; None takes those that the scene calls for.
            compensates: whether the integrator allows that samples of the environment leave out what samples of the
                BRDF find. They do so if the light depends on the direction, and if the BRDFs find all of it.
            microfacets: whether the roughness decides where a material has both Ns and a roughness.
        """
        microfacets &= self.material_library.has_both_models
        is_even = self.environment is None or self.environment.constant is not None
        compensates &= not is_even and self.material_library.reach_all(self.mesh.used_materials(), microfacets)
        if effects is not None:
            return SceneInKernels(self, effects, compensates, microfacets)
        light, effects = (self.environment, self.background, *self.lights), self.effects_for(microfacets)
        key = effects, light, compensates, microfacets
        return memory.recent(
            self._in_kernels, KEPT_FORMS, key, lambda: SceneInKernels(self, effects, compensates, microfacets)
        )

    def receipt(self, microfacets: bool = False) -> list[str]:
        """One line per effect, and for the intersector and the lamps: what is simulated, and why."""
        runs, own = type(self.ray_intersector).__name__, replaced(self.ray_intersector)
        why = why_replaced(self.ray_intersector) if own else f"{self.geometry.n_primitives:,} primitives"
        lines = [*self.effects_for(microfacets).receipt(), f"{'rays':<15} {runs}: {why}"]
        if self.lamps.count > 0:
            lines.append(f"{'lamp choice':<15} {self.lamps.choice.name}: one of {self.lamps.count:,} for each sample")
        return lines

    @property
    def materials(self) -> tuple[Material, ...]:
        """The ``Material`` of every material id."""
        return self.material_library.materials

    # ── questions of Python ──

    @ti.func
    def query_ray(self, ray):
        """HitData of the nearest hit of one ray, for kernels; Python calls ``intersect`` with any number of rays."""
        return self.ray_intersector.query_ray(ray)

    @one_at_a_time
    def intersect(
        self, origins: "ArrayLike", directions: "ArrayLike", t_min: "ArrayLike" = 0.0, t_max: "ArrayLike" = np.inf
    ) -> RayHits:
        """The nearest hit of every ray with t_min < t < t_max.

        Args:
            origins, directions: (N, 3) or (3,) arrays, or (…, 3); the members of the result have the shape of the
                rays, such as (h, w) for the rays of a picture. A direction may have any length except 0; ``distance``
                is in units of this length. Rays with NaN, with infinity or with a zero direction miss everything.
            t_min, t_max: one number for all rays, or an (N,) array with one number per ray.
        """
        self.check_alive()
        rays, shape = as_rays(origins, directions, t_min, t_max)
        hits, reals, whole = RayHits.of_memory(len(rays[0]), runtime.dtype())
        if len(hits) > 0:
            self._intersect(*rays, reals, whole)
        hits.is_hit = hits.is_hit.astype(bool)
        hits.is_backfacing = hits.is_backfacing.astype(bool)
        return hits.reshaped(shape)

    @one_at_a_time
    def occluded(
        self, origins: "ArrayLike", directions: "ArrayLike", t_min: "ArrayLike" = 0.0, t_max: "ArrayLike" = np.inf
    ) -> np.ndarray:
        """(N,) bool, or in the rays' shape: whether each hits something with t_min < t < t_max; see ``intersect``."""
        self.check_alive()
        rays, shape = as_rays(origins, directions, t_min, t_max)
        blocked = np.empty(len(rays[0]), np.int32)
        if len(blocked) > 0:
            self._occluded(*rays, blocked)
        return blocked.astype(bool).reshape(shape)

    @ti.kernel
    def _intersect(
        self,
        origins: ti.types.ndarray(ndim=2),
        directions: ti.types.ndarray(ndim=2),
        t_min: ti.types.ndarray(ndim=1),
        t_max: ti.types.ndarray(ndim=1),
        reals: ti.types.ndarray(ndim=1),
        whole: ti.types.ndarray(ndim=1),
    ):
        for i in range(origins.shape[0]):
            hit = self.ray_intersector.query_segment(ray_from(origins, directions, i), t_min[i], t_max[i])
            write_hit(hit, i, origins.shape[0], reals, whole)

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

    # ── its life ──

    def check_alive(self) -> None:
        """Raise a StaleSceneError if Taichi was initialised again after the scene was made."""
        self._memories[0].check("scene")

    @one_at_a_time
    def destroy(self) -> None:
        """Free the scene's memory now; it cannot be used afterwards."""
        for one in self._memories:
            one.free()
        self.ray_intersector.destroy()

    def __repr__(self) -> str:
        spheres = f"{self.num_spheres:,} spheres, " if self.num_spheres > 0 else ""
        return (
            f"SceneData({self.source!r}: {self.num_triangles:,} triangles, {spheres}{len(self.materials)} materials, "
            f"{self.ray_intersector.name}, {self.ray_intersector.triangle_test})"
        )


def again(former: SceneData, **changes: Any) -> SceneData:
    """A new scene with the primitives and parts of another one, except for some arguments of ``SceneData``."""
    own: dict[str, Any] = {
        **former.given,
        "intersector": former.chosen,
        "view": former._view_of if former.view is former._computed_view else former.view,
        "environment": former.environment,
        "background": former.background,
        "lights": former.lights,
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the primitives that are dropped were reported when this scene was made
        scene = SceneData(replace(former.given_mesh, lights=[]), **own | changes)
    scene.shots, scene.notes, scene.lights_of_file = former.shots, former.notes, former.lights_of_file
    return scene
