"""Further cameras; the pinhole camera is ``camera.Camera``.

A file has one class that derives from a camera of ``camera.py``, replaces ``generate_ray`` or one of its steps, and is
registered. Add a camera as a new file of this folder.
"""
