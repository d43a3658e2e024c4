"""Assignment 1: opens a window that shows the Cornell box with your own camera, intersector and views."""

from camera import Camera
from ray_intersector import RayIntersector
from renderer import A1Renderer

import taichi_tracer as tt
from taichi_tracer.apps.viewer import show


def main() -> int:
    """Run it: python A1.py"""
    scene_data = tt.load_scene_data("cornell_box", intersector=RayIntersector)
    camera = Camera(512, 512, eye=(0, 1, 3), at=(0, 1, 0), up=(0, 1, 0), fov=60.0)
    renderer = A1Renderer(scene_data, camera=camera).use("normal")
    return show(tt.teaching.marked(renderer))


if __name__ == "__main__":
    raise SystemExit(main())
