"""What lies under the pointer: the numbers of a pixel, and where its ray meets the scene."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from taichi_tracer.progressive import ProgressiveRenderer

DIGITS = 4


def numbers_of(values: np.ndarray) -> str:
    """Numbers in words: "0.52, 0.41, 0.3"; one number where all are the same."""
    texts = [f"{value:.{DIGITS}g}" for value in values]
    return texts[0] if len(set(texts)) == 1 else ", ".join(texts)


class PixelProbe:
    """A pixel that somebody points at.

    Args:
        column, row: of the pixel; the top left one is (0, 0). They are brought into the picture.
        renderer: what shows; its camera and its scene say what the pixel sees.
    """

    def __init__(self, column: int, row: int, renderer: ProgressiveRenderer) -> None:
        self.column, self.row = min(column, renderer.width - 1), min(row, renderer.height - 1)
        self._place_of: tuple = ()
        self._place = ""

    def numbers(self, renderers: Sequence[ProgressiveRenderer]) -> dict[str, Any]:
        """The pixel, its linear numbers in each picture that is shown, and what it sees, for a page."""
        values = [numbers_of(one.image()[self.row, self.column]) for one in renderers]
        return {"column": self.column, "row": self.row, "values": values, "place": self.place(renderers[0])}

    def place(self, renderer: ProgressiveRenderer) -> str:
        """What the ray through the middle of the pixel meets; asked again only when the camera or the scene is new."""
        camera, scene = renderer.camera, renderer.scene_data
        of = scene, scene.version, camera, camera.version
        if self._place_of != of:
            hit = scene.intersect(*camera.rays(self.column, renderer.height - 1 - self.row))[0]
            self._place_of, self._place = of, "nothing" if not hit.is_hit else place_of(hit, scene)
        return self._place


def place_of(hit: Any, scene: Any) -> str:
    """A hit in words: its position, its distance, the name of its material and the number of its primitive."""
    material = scene.mesh.materials[hit.material_id].name
    position = ", ".join(f"{x:.{DIGITS}g}" for x in hit.position)
    return f"({position}), {hit.distance:.{DIGITS}g} away: {material}, primitive {hit.triangle_id}"
