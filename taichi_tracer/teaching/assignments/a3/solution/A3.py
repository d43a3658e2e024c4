"""Assignment 3: opens a window that shows plates of four roughnesses under lamps of four sizes."""

from light_sampler import MeshLightSampler
from renderer import A3Renderer

import taichi_tracer as tt
from taichi_tracer.apps.viewer import show


def main() -> int:
    """Run it: python A3.py"""
    scene_data = tt.load_scene_data("veach_plates", lamp_choice=MeshLightSampler)
    renderer = A3Renderer(scene_data, 768, 384).use("mis")
    return show(tt.teaching.marked(renderer))


if __name__ == "__main__":
    raise SystemExit(main())
