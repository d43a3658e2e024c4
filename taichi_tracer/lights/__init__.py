"""Where light comes from: one light a file. ``base`` states the interface, ``scene_lights`` puts those of a scene together."""
