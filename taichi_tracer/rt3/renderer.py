"""RT3's pictures: an integrator of RT3 in front of the background of the scene file (RT-7)."""

from typing import TYPE_CHECKING, Any

import taichi as ti

from taichi_tracer.camera import make_camera
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.integrators.rt3 import DepthMap
from taichi_tracer.integrators.rt3_blinn_phong import BlinnPhong
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.system.parts import PARTS, overridable, register
from taichi_tracer.system.types import Numbers

if TYPE_CHECKING:
    from taichi_tracer.rt3.document import Shot
    from taichi_tracer.scene_data import SceneData


@register
@ti.data_oriented
@overridable()
class RT3Renderer(ProgressiveRenderer):
    """A picture of a scene with one of RT3's integrators. Arguments as for ``ProgressiveRenderer``."""

    name, what = "RT3Renderer", "integrator"
    value_names = "near_color", "far_color", "zmin", "zmax", "mirrors"

    def set_depth(
        self,
        near_color: Numbers = (0, 0, 0),
        far_color: Numbers = (1, 1, 1),
        zmin: float | None = None,
        zmax: float | None = None,
    ) -> None:
        """Set the colours and the range of the depth map; None takes the bound of the scene's box."""
        self._replace(DepthMap(near_color, far_color, zmin, zmax))

    def set_mirrors(self, depth: int) -> None:
        """Set how many mirrors one after the other "blinn_phong" follows."""
        self._replace(BlinnPhong(depth))

    def values(self) -> dict[str, Any]:
        """The arguments of ``set_depth``, and the ``mirrors`` that "blinn_phong" follows."""
        depth: Any = self._own(PARTS.find("integrator", "depth_map"))
        blinn_phong: Any = self._own(PARTS.find("integrator", "blinn_phong"))
        return depth.arguments() | {"mirrors": blinn_phong.depth}

    def change(self, name: str, value: Any) -> None:
        """Change one of ``values``."""
        values = self.values()
        mirrors = values.pop("mirrors")
        if name in values:
            self.set_depth(**values | {name: value})
        elif name == "mirrors" and value != mirrors:
            self.set_mirrors(value)
        elif name != "mirrors":
            super().change(name, value)

    def _replace(self, integrator: Integrator) -> None:
        self._integrators[integrator.name] = integrator
        if self.active.name == integrator.name:
            self.use(integrator.name)


def renderer_of(scene_data: "SceneData", shot: "Shot | None" = None, **options: Any) -> ProgressiveRenderer:
    """The renderer for a picture of a scene file, with its camera, the size and the crop of its film, its integrator.

    Args:
        scene_data: the scene that was read from the file.
        shot: one of its pictures; None takes the first.
        options: arguments of ``ProgressiveRenderer``; they replace the settings of the file.
    """
    shot = scene_data.shots[0] if shot is None else shot
    film = shot.film
    if "camera" not in options:
        size = options.pop("width", film.width), options.pop("height", film.height)
        options["camera"] = make_camera(*size, **shot.view)
    camera = options["camera"]
    options.setdefault("crop", film.crop(camera.width, camera.height))
    integrator = shot.integrator
    if integrator.spp is not None:
        return A2Renderer(scene_data, **options).use(integrator.name)
    renderer = RT3Renderer(scene_data, **options).use(integrator.name)
    for name, value in integrator.values.items():
        renderer.change(name, value)
    return renderer
