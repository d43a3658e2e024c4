"""RT3, phase 2: opens a window that shows the Cornell box through your own perspective camera."""

from camera import PerspectiveCamera

import taichi_tracer as tt
from taichi_tracer.apps.viewer import show


def main() -> int:
    """Run it: python view.py"""
    camera = PerspectiveCamera(512, 512, eye=(0, 1, 3), at=(0, 1, 0), up=(0, 1, 0), fov=60.0)
    renderer = tt.A1Renderer(tt.load_scene_data("cornell_box"), camera=camera).use("normal")
    return show(tt.teaching.marked(renderer))


if __name__ == "__main__":
    raise SystemExit(main())
