"""Formulas as pure functions of plain values: triangles, boxes, spheres, frames, warps, hashes, camera frames."""
