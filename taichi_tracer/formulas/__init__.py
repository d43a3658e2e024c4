"""Formulas that kernels use, one subject per file; nothing here knows a scene.

They are the first of the package's functions with ``@ti.func`` that are imported. Therefore Taichi is told here how to
find the class of a function quickly.
"""

from taichi_tracer.system import front_end

front_end.find_classes_quickly()
