"""RT3, light: opens a window that shows three balls under your own lights."""

from blinn_phong import BlinnPhong
from lights import AmbientLight, DirectionalLight, PointLight, SpotLight

import taichi_tracer as tt
from taichi_tracer.apps.viewer import show


def main() -> int:
    """Run it: python view.py"""
    scene = tt.load_scene_data("rt3/all_lights")
    sun = DirectionalLight(direction=(4, -5, 6), irradiance=0.35)
    lamp = PointLight((0.4, 3.2, -1.2), intensity=(6, 4.5, 2.7), attenuation=(1, 0, 1))
    spot = SpotLight((5, 5, -3), target=(2.3, 0.6, 0), intensity=(3, 8, 30), cutoff=16, falloff=11)
    scene.lights = [AmbientLight(0.12), sun, lamp, spot]
    camera = tt.Camera(512, 512, eye=(0, 3, -9), at=(0, 0.9, 0), up=(0, 1, 0), fov=45.0)
    renderer = tt.RT3Renderer(scene, camera=camera).use(BlinnPhong(depth=4))
    return show(tt.teaching.marked(renderer))


if __name__ == "__main__":
    raise SystemExit(main())
