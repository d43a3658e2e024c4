"""Assignment 1: the Cornell box in six views, in a window, or as pictures in renders/ where no window can open."""

import taichi_tracer as tt
from taichi_tracer.apps.viewer import show


def main() -> int:
    """Run it: python interactive/A1.py"""
    scene_data = tt.load_scene_data("cornell_box")
    renderer = tt.A1Renderer(scene_data=scene_data, width=512, height=512)
    renderer.camera.set_camera_parameters(eye=(0, 1, 3), at=(0, 1, 0), up=(0, 1, 0), fov=60.0)
    renderer.set_shade_normal()
    return show(renderer)


if __name__ == "__main__":
    raise SystemExit(main())
