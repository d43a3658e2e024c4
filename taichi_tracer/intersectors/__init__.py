"""Acceleration structures: they find the nearest hit without a test of every triangle.

A file has one intersector, which derives from ``ray_intersector.RayIntersector`` and is registered, or what it is built
from. Add an intersector as a new file of this folder; read ``bvh.py`` first.
"""
