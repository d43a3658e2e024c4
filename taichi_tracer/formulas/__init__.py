"""Formulas as pure functions over plain values: triangles, boxes, spheres, frames, warps, hashes, camera frames."""
