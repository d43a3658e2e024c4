"""Assignment 4: opens a window that shows the Cornell box, lit by its lamp over several bounces."""

from renderer import A4Renderer

import taichi_tracer as tt
from taichi_tracer.apps.viewer import show


def main() -> int:
    """Run it: python A4.py"""
    scene_data = tt.load_scene_data("cornell_box", lamp_choice=tt.MeshLightSampler)
    renderer = A4Renderer(scene_data, 512, 512).use("explicit")
    return show(tt.teaching.marked(renderer))


if __name__ == "__main__":
    raise SystemExit(main())
