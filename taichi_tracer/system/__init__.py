"""The base of the package: the start of Taichi, memory, errors, the registry, and replaced methods.

A file has one service, which knows nothing of rays and scenes. Add a service as a new file; what depends on the version
of Taichi belongs to ``taichi_17``, and what reads a student's functions to ``own_code``.
"""
