"""Explains one pixel: every number on the way from the pixel to its colour, from the code that makes the picture."""
