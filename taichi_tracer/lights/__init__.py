"""The sources of light: one light per file. ``base`` states the interface, ``scene_lights`` joins a scene's lights."""
