"""Changes of Taichi 1.7 with which kernels compile faster. Without this folder, the package works, slower.

A file has the replacements of one subject. Add a replacement there, and enter it in the table of ``patches.py``.
"""
