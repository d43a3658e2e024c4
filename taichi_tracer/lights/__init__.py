"""Sources of light, and the choice among the lamps of a scene.

A file has one class that derives from ``base.Light`` (``sample``, ``pdf``, ``radiance``) or from ``choice.LampChoice``,
and is registered. Add a light as a new file of this folder; ``scene_lights.py`` joins the lights of a scene.
"""
