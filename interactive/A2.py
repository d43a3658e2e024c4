"""Assignment 2: three spheres in a studio, by every estimator, in a window or as pictures in renders/."""

import taichi_tracer as tt
from taichi_tracer.apps.viewer import show


def main() -> int:
    """Run it: python interactive/A2.py"""
    scene_data = tt.load_scene_data("specular_spheres", environment="studio")
    renderer = tt.A2Renderer(scene_data=scene_data, width=512, height=512)
    renderer.camera.set_camera_parameters(eye=(0, 1, 3), at=(0, 1, 0), up=(0, 1, 0), fov=60.0)
    renderer.set_sample_brdf()
    return show(renderer)


if __name__ == "__main__":
    raise SystemExit(main())
