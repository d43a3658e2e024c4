"""Side-by-side measurements with the renderers that a user could pick instead; never part of the tests."""
