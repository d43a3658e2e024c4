"""What lies under the pointer: the numbers of a pixel, and where its ray meets the scene."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from taichi_tracer.progressive import ProgressiveRenderer

DIGITS = 4
MOST_VALUES = 4096  # pixels whose numbers are shown at once


def numbers_of(values: np.ndarray) -> str:
    """Numbers in words: "0.52, 0.41, 0.3"; one number where all are the same."""
    texts = [f"{value:.{DIGITS}g}" for value in values]
    return texts[0] if len(set(texts)) == 1 else ", ".join(texts)


def look_at(column: int, row: int, renderers: Sequence[ProgressiveRenderer]) -> dict[str, Any]:
    """A pixel, its linear numbers in each picture that is shown, and what it sees, for a page.

    Args:
        column, row: of the pixel; the top left one is (0, 0). They are brought into the picture.
    """
    first = renderers[0]
    column, row = min(column, first.width - 1), min(row, first.height - 1)
    values = [numbers_of(one.image()[row, column]) for one in renderers]
    hit = first.scene_data.intersect(*first.camera.rays(column, first.height - 1 - row))[0]
    place = place_of(hit, first.scene_data) if hit.is_hit else "nothing"
    return {"column": column, "row": row, "values": values, "place": place}


def place_of(hit: Any, scene: Any) -> str:
    """A hit in words: its position, its distance, the name of its material and the number of its primitive."""
    material = scene.mesh.materials[hit.material_id].name
    position = ", ".join(f"{x:.{DIGITS}g}" for x in hit.position)
    return f"({position}), {hit.distance:.{DIGITS}g} away: {material}, primitive {hit.triangle_id}"


def linear_values(renderer: ProgressiveRenderer, column: int, row: int, columns: int, rows: int) -> dict[str, Any]:
    """The numbers of a region of pixels, row by row: red, green and blue, with three digits; none of too many."""
    part = renderer.image()[row : row + rows, column : column + columns]
    few = part.reshape(-1).tolist() if part.size <= 3 * MOST_VALUES else []
    values = [float(f"{value:.3g}") if np.isfinite(value) else None for value in few]
    return {"column": column, "row": row, "columns": part.shape[1], "values": values}
