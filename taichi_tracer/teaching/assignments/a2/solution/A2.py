"""Assignment 2: opens a window that shows three spheres under a sky, with your own estimators."""

from camera import Camera
from environment import Environment
from renderer import A2Renderer

import taichi_tracer as tt
from taichi_tracer.apps.viewer import show
from taichi_tracer.environment import load_environment


def main() -> int:
    """Run it: python A2.py"""
    sky = load_environment("studio")
    scene_data = tt.load_scene_data("specular_spheres", environment=Environment(sky.pixels))
    camera = Camera(512, 512, eye=(0, 1, 3), at=(0, 1, 0), up=(0, 1, 0), fov=60.0)
    renderer = A2Renderer(scene_data, camera=camera).use("brdf")
    return show(tt.teaching.marked(renderer))


if __name__ == "__main__":
    raise SystemExit(main())
