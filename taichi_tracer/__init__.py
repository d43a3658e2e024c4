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

_HOME_OF = {
    "init": "system.runtime",
    "register": "system.registry",
    "InputError": "system.errors",
    "StaleSceneError": "system.errors",
    "Ray": "ray",
    "HitData": "ray",
    "no_hit": "ray",
    "Camera": "camera",
    "OrthographicCamera": "camera",
    "Background": "background",
    "Mesh": "geometry",
    "Geometry": "geometry",
    "Material": "materials",
    "MaterialLibrary": "materials",
    "TriangleTest": "formulas.triangles",
    "RayIntersector": "ray_intersector",
    "BruteForceRayIntersector": "ray_intersector",
    "BVHRayIntersector": "intersectors.bvh",
    "Sampler": "sampler",
    "UniformSampler": "sampler",
    "BRDF": "sampler",
    "Brdf": "brdfs.base",
    "Light": "lights.base",
    "Integrator": "integrators.base",
    "View": "integrators.base",
    "DirectLight": "integrators.direct_light",
    "SceneData": "scene_data",
    "scene_from_mesh": "scene_data",
    "load_scene_data": "scene_data_loader",
    "scene_names": "scene_data_loader",
    "Environment": "environment",
    "A1Renderer": "renderer",
    "A2Renderer": "renderer",
    "A3Renderer": "renderer",
    "A4Renderer": "renderer",
    "LampChoice": "lights.choice",
    "RT3Renderer": "rt3.renderer",
    "save_image": "files.images",
    "read_image": "files.images",
}

_PACKAGES = ("studies",)

__all__ = ["__version__", *_HOME_OF]


def __getattr__(name: str) -> object:
    if name in _PACKAGES:
        return importlib.import_module(f"taichi_tracer.{name}")
    if name not in _HOME_OF:
        raise AttributeError(f"module 'taichi_tracer' has no attribute {name!r}")
    module = importlib.import_module(f"taichi_tracer.{_HOME_OF[name]}")
    value = getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, *_PACKAGES])
