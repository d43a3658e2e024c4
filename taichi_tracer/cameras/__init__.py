"""Further cameras: one camera per file. ``camera`` has the steps from a pixel to a ray, and the pinhole camera."""
