"""A list of small pictures: every shipped scene × view × estimator × sampler, and the settings that change bits.

``pictures`` names them and says how each is made; ``Maker`` makes those of one scene; ``digest`` is what
``references/pictures.json`` keeps of each. ``canary`` tells whether this machine rounds as the one that made the file.
"""

import copy
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.camera import make_camera
from taichi_tracer.system import runtime

MAX_DISTANCE = 10.0  # of the view of the distance, in every scene
SIZE = (44, 36)  # neither square nor a multiple of a packet
MESHES = ("blob", "cornell_box", "cube", "specular_spheres", "sphere", "torus_knot")
DOCUMENTS = (
    "document_orthographic",
    "document_perspective",
    "four_corners",
    "three_spheres",
    "transforms",
    "two_views",
)
VIEWS = ("hit", "triangle_id", "distance", "barycentric", "normal", "material_id")
ESTIMATORS = ("uniform", "hemisphere", "brdf", "environment", "mis", "mis_balance")
INTEGRATORS = ("flat", "normal_map", "depth_map")
SAMPLERS = ("sobol", "independent")
STUDIO = {"environment": "studio"}
LAMPS = "lamps"  # a scene option of this list: "off" makes every material black that emits light
# From where the meshes are seen, whatever a scene's own camera is, so that digests change only with the renderer.
VIEW = {"eye": (0, 1, 3), "at": (0, 1, 0), "up": (0, 1, 0), "fov": 60.0}
ORTHOGRAPHIC = {"projection": "orthographic", "screen_window": (-1.6, 1.6, -1.2, 1.2)}


@dataclass(frozen=True)
class Picture:
    """How one picture is made.

    Attributes:
        scene: a shipped name.
        shows: a view, an estimator or an integrator.
        spp: samples per pixel; 0 is what the pixel's centre shows.
        precision: "f32" or "f64".
        options: of the renderer. scene_options: of the scene, and ``LAMPS``.
    """

    scene: str
    shows: str
    spp: int = 0
    precision: str = "f32"
    options: dict = field(default_factory=dict)
    scene_options: dict = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What the file of hashes calls it."""
        words = [self.scene, self.shows, f"{self.spp} spp", self.precision]
        words += [f"{key}={value}" for key, value in {**self.scene_options, **self.options}.items()]
        return ", ".join(words)

    @property
    def group(self) -> str:
        """What the pictures of one scene, made the same way, have in common."""
        options = [f"{key}={value}" for key, value in self.scene_options.items()]
        return ", ".join([self.precision, self.scene, *options])

    @property
    def renderer_class(self) -> type:
        """The renderer that offers what the picture shows."""
        if self.shows in ESTIMATORS:
            return tt.A2Renderer
        return tt.RT3Renderer if self.shows in INTEGRATORS else tt.A1Renderer

    @property
    def is_quick(self) -> bool:
        """Whether it is compared in every run of the tests: every scene, view, estimator and sampler at least once."""
        if self.precision == "f64" or "triangle_test" in self.scene_options:
            return False
        if self.scene.startswith("rt3/"):
            every_integrator = self.scene == "rt3/transforms" and self.shows in INTEGRATORS
            return self.spp == 0 and (every_integrator or self.shows == "normal_map")
        if self.scene == "cornell_box":
            return self.spp == 0 and self.options == {}
        if self.scene == "specular_spheres":
            return self.shows == "mis" and self.scene_options == STUDIO and self.options == {"sampler": "sobol"}
        if self.scene == "cube":
            sampler = "independent" if self.shows == "brdf" else "sobol"
            return self.shows in ESTIMATORS and self.shows != "mis" and self.options == {"sampler": sampler}
        return self.spp == 0 and self.shows == "normal"


def pictures() -> Iterator[Picture]:
    """Every picture that is compared."""
    for scene in MESHES:
        for view in VIEWS:
            yield Picture(scene, view)
            for sampler in SAMPLERS:
                yield Picture(scene, view, 3, options={"jitter": True, "sampler": sampler})
        for estimator in ESTIMATORS:
            for sampler in SAMPLERS:
                yield Picture(scene, estimator, 3, "f32", {"sampler": sampler}, STUDIO)
        yield Picture(scene, "normal", precision="f64")
        yield Picture(scene, "mis", 3, "f64", {}, STUDIO)
        for view in ("normal", "triangle_id"):
            yield Picture(scene, view, scene_options={"triangle_test": "moller_trumbore"})
    for scene in ("cornell_box", "specular_spheres"):
        for environment in ("sunny", "white", "black"):
            for estimator in ("brdf", "environment", "mis"):
                yield Picture(scene, estimator, 3, "f32", {}, {"environment": environment})
        yield Picture(scene, "mis", 3, "f32", {}, {**STUDIO, "triangle_test": "moller_trumbore"})
        yield Picture(scene, "brdf", 5, "f32", {"seed": 7, "first_sample": 11}, STUDIO)
        yield Picture(scene, "mis", 4, "f32", {"crop": (5, 30, 7, 29)}, STUDIO)
        yield Picture(scene, "brdf", 20, "f32", {"adaptive": True}, STUDIO)
        yield Picture(scene, "normal", 0, "f32", {"projection": "orthographic"})
        yield Picture(scene, "mis", 2, "f32", {"projection": "orthographic"}, STUDIO)
    off = {**STUDIO, LAMPS: "off"}
    for estimator in ESTIMATORS:
        yield Picture("cornell_box", estimator, 3, "f32", {}, off)
    yield Picture("cornell_box", "mis", 3, "f64", {}, off)
    for scene in DOCUMENTS:
        for what in (*VIEWS, *INTEGRATORS):
            yield Picture(f"rt3/{scene}", what)
        yield Picture(f"rt3/{scene}", "flat", 3, "f32", {"jitter": True})
        yield Picture(f"rt3/{scene}", "brdf", 3, "f32", {}, STUDIO)
        yield Picture(f"rt3/{scene}", "mis", 3, "f32", {}, STUDIO)


def groups(which) -> dict[str, list[Picture]]:
    """Group → its pictures, of those for which ``which`` is true; f32 first, since Taichi is started per precision."""
    found: dict[str, list[Picture]] = {}
    for picture in sorted(filter(which, pictures()), key=lambda p: p.group):
        found.setdefault(picture.group, []).append(picture)
    return found


class Maker:
    """Makes the pictures of one group: the scene is loaded once, and a renderer is made once for equal options."""

    def __init__(self, group: list[Picture]) -> None:
        options = dict(group[0].scene_options)
        lamps = options.pop(LAMPS, "on")
        self.scene = tt.load_scene_data(group[0].scene, **options)
        if lamps == "off":
            self.scene = without_lamps(self.scene)
        self.renderers = {}

    def __call__(self, picture: Picture) -> np.ndarray:
        """(height, width, 3)."""
        key = picture.renderer_class, repr(picture.options)
        if key not in self.renderers:
            self.renderers[key] = self.renderer(picture)
        renderer = self.renderers[key]
        renderer.begin_anew()
        return renderer.use(picture.shows).render(picture.spp or 1).image()

    def renderer(self, picture: Picture) -> tt.A1Renderer:
        """A renderer with the picture's options."""
        options, view = (
            {"sampler": "sobol", **picture.options},
            dict(VIEW if picture.scene in MESHES else self.scene.view),
        )
        if "projection" in options:
            options.pop("projection")
            view = {**ORTHOGRAPHIC, **{name: view[name] for name in ("eye", "at", "up")}}
        renderer = picture.renderer_class(self.scene, camera=make_camera(*SIZE, **view), **options)
        if isinstance(renderer, tt.A1Renderer):
            renderer.max_distance = MAX_DISTANCE
        return renderer

    def destroy(self) -> None:
        """Free the scene's memory."""
        self.scene.destroy()


def without_lamps(scene: tt.SceneData) -> tt.SceneData:
    """The same scene, but none of its materials emits light."""
    mesh = copy.copy(scene.mesh)
    mesh.materials = [replace(material, Ke=(0.0, 0.0, 0.0)) for material in mesh.materials]
    dark = tt.SceneData(mesh, view=scene.view, environment=scene.environment)
    scene.destroy()
    return dark


def digest(array: np.ndarray) -> str:
    """Of the bits of a picture."""
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]


CANARY_NUMBERS = 10_000


@ti.kernel
def _elementary(x: ti.types.ndarray(ndim=1), out: ti.types.ndarray(ndim=2)):
    for i in range(x.shape[0]):
        t = x[i]  # in (0, 1)
        out[i, 0] = ti.sin(20 * t - 10)
        out[i, 1] = ti.cos(20 * t - 10)
        out[i, 2] = ti.exp(30 * t - 25)
        out[i, 3] = ti.log(100 * t)
        out[i, 4] = ti.sqrt(100 * t)
        out[i, 5] = ti.atan2(2 * t - 1, 1 - t * t)
        out[i, 6] = ti.asin(2 * t - 1)
        out[i, 7] = ti.pow(t, 50 * t)


def canary() -> str:
    """The digest of sin, cos, exp, log, sqrt, atan2, asin and pow of 10,000 fixed numbers, in the running precision.

    Kernels take these functions from the platform's mathematical library, which IEEE 754 allows to round the last bit
    as it likes: pictures can be compared bit for bit where it rounds alike.
    """
    x = ((np.arange(CANARY_NUMBERS) + 0.5) / CANARY_NUMBERS).astype(runtime.dtype())
    out = np.zeros((CANARY_NUMBERS, 8), runtime.dtype())
    _elementary(x, out)
    return digest(out)
