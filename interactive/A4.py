"""Assignment 4: the Cornell box, lit by its lamp over several bounces, in a window or as pictures in renders/."""

import taichi_tracer as tt
from taichi_tracer.apps.viewer import show


def main() -> int:
    """Run it: python interactive/A4.py"""
    scene_data = tt.load_scene_data("cornell_box")
    renderer = tt.A4Renderer(scene_data=scene_data, width=512, height=512)
    renderer.set_shading_explicit()
    return show(renderer)


if __name__ == "__main__":
    raise SystemExit(main())
