"""Hierarchies, which leave out triangles that a ray cannot hit; one per file. See ``ray_intersector``."""
