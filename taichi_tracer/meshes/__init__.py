"""Operations on meshes before a scene copies them to Taichi.

A file has functions of one kind, which take a ``Mesh`` or numpy arrays and know no file format and no kernel. Add
another operation to the file of its kind, or as a new file.
"""
