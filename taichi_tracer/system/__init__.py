"""What everything stands on: Taichi's start, memory, errors, the registry of parts, and where methods are replaced."""
