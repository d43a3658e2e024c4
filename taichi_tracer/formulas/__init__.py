"""Formulas that kernels and numpy compute, without a scene.

A file has the functions of one subject: plain values in, plain values out, and the source beside each equation. Add a
formula to the file of its subject, or as a new file with a test of the same name in ``tests/formulas``.
"""
