"""What a student has written: checked before a kernel is compiled of it, and its errors told in one line.

Taichi ends the process where a method gives nothing, or something of another kind, and tells other mistakes by texts of
many lines, in which most places belong to the package. ``interface`` compares a class with the class from which it
derives. ``rules`` reads its functions. ``kinds`` looks at what its methods return while a kernel is read. ``faults``
tells what Taichi refuses. Nothing of it looks at the package's own code.
"""
