"""The base of everything: the start of Taichi, memory, errors, the registry of parts, and replaced methods."""
