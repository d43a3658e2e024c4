"""A teaching ray tracer in Taichi: what accuracy costs in time, and what keeps hard cases stable.

    import taichi_tracer as tt
    scene = tt.load_scene_data("cornell_box")
    renderer = tt.A1Renderer(scene_data=scene)
    renderer.use("normal").render()
    renderer.save("normal.png")

A name is loaded when it is first used. Importing the package does not start Taichi.
"""

import importlib as _importlib  # with other names, so that editors do not offer them
import os as _os

# Taichi reads both variables when it is imported. They switch off its search for a new version and its banner.
_os.environ.setdefault("TI_SKIP_VERSION_CHECK", "ON")
_os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")

# If the variable HOME is missing, Taichi ends the process on import. ``expanduser`` asks the system for the folder.
if _os.name == "posix":
    _os.environ.setdefault("HOME", _os.path.expanduser("~"))

__version__ = "0.2.0"

# Public name → the module that defines it. ``__init__.pyi`` says the same to editors and type checkers.
_HOME_OF = {
    "init": "system.runtime",
    "register": "system.parts",
    "InputError": "system.errors",
    "StaleSceneError": "system.errors",
    "Ray": "ray",
    "HitData": "ray",
    "no_hit": "ray",
    "Camera": "camera",
    "OrthographicCamera": "cameras.orthographic",
    "Background": "environment",
    "Mesh": "geometry",
    "Instances": "instances",
    "group": "instances",
    "Geometry": "geometry",
    "Material": "materials",
    "MaterialLibrary": "materials",
    "Texture": "materials",
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
    "AmbientLight": "lights.delta_lights",
    "DirectionalLight": "lights.delta_lights",
    "PointLight": "lights.delta_lights",
    "SpotLight": "lights.delta_lights",
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
    "MapRenderer": "explain.maps",
    "LampChoice": "lights.choice",
    "RT3Renderer": "rt3.renderer",
    "Picture": "files.images",
    "save_image": "files.images",
    "read_image": "files.images",
    "show": "apps.page.widget",
}

_PACKAGES = ("cluster", "course", "studies", "teaching")


__all__ = ["__version__", *_HOME_OF]


def __getattr__(name: str) -> object:
    if name not in _HOME_OF and name not in _PACKAGES:
        raise AttributeError(f"module 'taichi_tracer' has no attribute {name!r}")
    import_quickly = _importlib.import_module("taichi_tracer.system.importing").import_quickly
    if name in _PACKAGES:
        return import_quickly(f"taichi_tracer.{name}")
    value = getattr(import_quickly(f"taichi_tracer.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, *_PACKAGES])
