"""Integrators: what a ray shows, from views of the hit to paths of light.

A file has classes that derive from ``base.Integrator``, ``base.View`` or ``direct_light.DirectLight``, with one method
that takes a sample, and are registered. Add an integrator as a new file of this folder; ``scene_in_kernels.py`` is the
scene that it gets.
"""
