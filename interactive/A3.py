"""Assignment 3: plates of four roughnesses under lamps of four sizes, in a window or as pictures in renders/."""

import taichi_tracer as tt
from taichi_tracer.apps.viewer import show


def main() -> int:
    """Run it: python interactive/A3.py"""
    scene_data = tt.load_scene_data("veach_plates")
    renderer = tt.A3Renderer(scene_data=scene_data, width=768, height=384)
    renderer.set_sample_mis_one_sample()
    return show(renderer)


if __name__ == "__main__":
    raise SystemExit(main())
