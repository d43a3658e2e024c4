"""How surfaces reflect light: one BRDF per file. ``base`` states the interface."""
