"""Where light comes from: one light a file. ``base`` states the interface, ``scene_lights`` joins those of a scene."""
