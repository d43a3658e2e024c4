"""The explanation of one pixel: every number on the way from the pixel to its colour.

Observed parts write a log (``pixel.py``); the log becomes a tree of steps, and the steps become text and drawings
(``explanation.py``).
"""
