"""What reaches into Taichi 1.7: ``patches.py`` has the table. Without this folder, the package works, slower."""
