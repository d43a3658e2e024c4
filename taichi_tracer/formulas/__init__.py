"""Formulas that kernels use, one subject per file; nothing here knows a scene."""
