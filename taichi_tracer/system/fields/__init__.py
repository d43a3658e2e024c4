"""Memory of Taichi's fields: allocated and freed with its owner, and written from numpy at once.

A file has one way to keep numbers for kernels. A new kind of field is a new file.
"""
