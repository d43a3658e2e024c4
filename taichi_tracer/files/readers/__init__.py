"""Readers of meshes: a file for each format, which gives a ``Mesh`` or an error with file and line.

Add a format as a file here, and its ending to ``files/meshes.py``.
"""
