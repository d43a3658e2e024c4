"""BRDFs: how surfaces reflect light.

A file has a class that derives from ``base.Brdf``, with ``eval``, ``pdf`` and ``sample``, and is registered. Add a
BRDF as a new file of this folder; ``surface.py`` gives integrators the BRDF of the material at a hit.
"""
