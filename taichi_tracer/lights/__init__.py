"""Sources of light, and the choice among the lamps of a scene.

A file has classes that derive from ``base.Light`` (``sample``, ``pdf``, ``radiance``) or from ``choice.LampChoice``,
and are registered. Add a light as a new file of this folder; ``scene_lights.py`` joins the lights of a scene.
"""
