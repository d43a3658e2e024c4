"""A teaching ray tracer in Taichi: what accuracy costs in time, and what keeps hard cases stable.

    import taichi_tracer as tt
    scene = tt.load_scene_data("cornell_box")
    renderer = tt.A1Renderer(scene_data=scene)
    renderer.use("normal").render()
    renderer.save("normal.png")

A name is loaded when it is first used. Importing the package does not start Taichi.
"""

import importlib
import os

# Taichi reads both variables when it is imported. They switch off its search for a new version and its banner.
os.environ.setdefault("TI_SKIP_VERSION_CHECK", "ON")
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")

# If the variable HOME is missing, Taichi ends the process on import. ``expanduser`` asks the system for the folder.
if os.name == "posix":
    os.environ.setdefault("HOME", os.path.expanduser("~"))

__version__ = "0.1.0"

TYPE_CHECKING = False  # editors and type checkers take it for True; the module ``typing``, which says it, loads slowly

# Public name → the module that defines it. The imports at the end of this file say the same to editors.
_HOME_OF = {
    "init": "system.runtime",
    "register": "system.registry",
    "InputError": "system.errors",
    "StaleSceneError": "system.errors",
    "Ray": "ray",
    "HitData": "ray",
    "no_hit": "ray",
    "Camera": "camera",
    "OrthographicCamera": "cameras.orthographic",
    "Background": "background",
    "Mesh": "geometry",
    "Instances": "instances",
    "group": "instances",
    "Geometry": "geometry",
    "Material": "materials",
    "MaterialLibrary": "materials",
    "Texture": "textures",
    "TriangleTest": "formulas.triangles",
    "RayIntersector": "ray_intersector",
    "BruteForceRayIntersector": "ray_intersector",
    "BVHRayIntersector": "intersectors.bvh",
    "Sampler": "sampler",
    "UniformSampler": "sampler",
    "BRDF": "sampler",
    "MicrofacetBRDF": "brdfs.microfacet",
    "MeshLightSampler": "lights.mesh_light_sampler",
    "Brdf": "brdfs.base",
    "Light": "lights.base",
    "AmbientLight": "lights.ambient_light",
    "DirectionalLight": "lights.directional_light",
    "PointLight": "lights.point_light",
    "SpotLight": "lights.spot_light",
    "Integrator": "integrators.base",
    "View": "integrators.base",
    "Tone": "tones.base",
    "DirectLight": "integrators.direct_light",
    "BlinnPhong": "integrators.rt3_blinn_phong",
    "SceneData": "scene_data",
    "scene_from_mesh": "scene_data_loader",
    "load_scene_data": "scene_data_loader",
    "load_mesh": "scene_data_loader",
    "scene_names": "scene_data_loader",
    "Environment": "environment",
    "A1Renderer": "renderer",
    "A2Renderer": "renderer",
    "A3Renderer": "renderer",
    "A4Renderer": "renderer",
    "MapRenderer": "maps",
    "LampChoice": "lights.choice",
    "RT3Renderer": "rt3.renderer",
    "Picture": "files.picture",
    "save_image": "files.images",
    "read_image": "files.images",
    "show": "apps.widget",
}

_PACKAGES = ("cluster", "course", "studies", "teaching")


if not TYPE_CHECKING:
    # Without the names whose folder was taken off, see ``system.wings``; to ask for one of these says what is missing.
    _THERE = {name.removesuffix(".py") for name in os.listdir(os.path.dirname(__file__))}
    __all__ = ["__version__", *(name for name, home in _HOME_OF.items() if home.split(".")[0] in _THERE)]

    def __getattr__(name: str) -> object:
        if name not in _HOME_OF and name not in _PACKAGES:
            raise AttributeError(f"module 'taichi_tracer' has no attribute {name!r}")
        wing = importlib.import_module("taichi_tracer.system.wings").wing
        if name in _PACKAGES:
            return wing(name)
        value = getattr(wing(_HOME_OF[name]), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted([*__all__, *_THERE.intersection(_PACKAGES)])

else:  # Editors and type checkers do not run __getattr__: they read these lines, which never run.
    from taichi_tracer import cluster as cluster
    from taichi_tracer import course as course
    from taichi_tracer import studies as studies
    from taichi_tracer import teaching as teaching
    from taichi_tracer.apps.widget import show as show
    from taichi_tracer.background import Background as Background
    from taichi_tracer.brdfs.base import Brdf as Brdf
    from taichi_tracer.brdfs.microfacet import MicrofacetBRDF as MicrofacetBRDF
    from taichi_tracer.camera import Camera as Camera
    from taichi_tracer.cameras.orthographic import OrthographicCamera as OrthographicCamera
    from taichi_tracer.environment import Environment as Environment
    from taichi_tracer.files.images import read_image as read_image
    from taichi_tracer.files.images import save_image as save_image
    from taichi_tracer.files.picture import Picture as Picture
    from taichi_tracer.formulas.triangles import TriangleTest as TriangleTest
    from taichi_tracer.geometry import Geometry as Geometry
    from taichi_tracer.geometry import Mesh as Mesh
    from taichi_tracer.instances import Instances as Instances
    from taichi_tracer.instances import group as group
    from taichi_tracer.integrators.base import Integrator as Integrator
    from taichi_tracer.integrators.base import View as View
    from taichi_tracer.integrators.direct_light import DirectLight as DirectLight
    from taichi_tracer.integrators.rt3_blinn_phong import BlinnPhong as BlinnPhong
    from taichi_tracer.intersectors.bvh import BVHRayIntersector as BVHRayIntersector
    from taichi_tracer.lights.ambient_light import AmbientLight as AmbientLight
    from taichi_tracer.lights.base import Light as Light
    from taichi_tracer.lights.choice import LampChoice as LampChoice
    from taichi_tracer.lights.directional_light import DirectionalLight as DirectionalLight
    from taichi_tracer.lights.mesh_light_sampler import MeshLightSampler as MeshLightSampler
    from taichi_tracer.lights.point_light import PointLight as PointLight
    from taichi_tracer.lights.spot_light import SpotLight as SpotLight
    from taichi_tracer.maps import MapRenderer as MapRenderer
    from taichi_tracer.materials import Material as Material
    from taichi_tracer.materials import MaterialLibrary as MaterialLibrary
    from taichi_tracer.ray import HitData as HitData
    from taichi_tracer.ray import Ray as Ray
    from taichi_tracer.ray import no_hit as no_hit
    from taichi_tracer.ray_intersector import BruteForceRayIntersector as BruteForceRayIntersector
    from taichi_tracer.ray_intersector import RayIntersector as RayIntersector
    from taichi_tracer.renderer import A1Renderer as A1Renderer
    from taichi_tracer.renderer import A2Renderer as A2Renderer
    from taichi_tracer.renderer import A3Renderer as A3Renderer
    from taichi_tracer.renderer import A4Renderer as A4Renderer
    from taichi_tracer.rt3.renderer import RT3Renderer as RT3Renderer
    from taichi_tracer.sampler import BRDF as BRDF
    from taichi_tracer.sampler import Sampler as Sampler
    from taichi_tracer.sampler import UniformSampler as UniformSampler
    from taichi_tracer.scene_data import SceneData as SceneData
    from taichi_tracer.scene_data_loader import load_mesh as load_mesh
    from taichi_tracer.scene_data_loader import load_scene_data as load_scene_data
    from taichi_tracer.scene_data_loader import scene_from_mesh as scene_from_mesh
    from taichi_tracer.scene_data_loader import scene_names as scene_names
    from taichi_tracer.system.errors import InputError as InputError
    from taichi_tracer.system.errors import StaleSceneError as StaleSceneError
    from taichi_tracer.system.registry import register as register
    from taichi_tracer.system.runtime import init as init
    from taichi_tracer.textures import Texture as Texture
    from taichi_tracer.tones.base import Tone as Tone
