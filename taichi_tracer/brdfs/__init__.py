"""How surfaces reflect: one BRDF a file. ``base`` states the interface."""
