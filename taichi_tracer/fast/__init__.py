"""Fast forms of what the rest of the package says plainly, with the same bits. Nobody needs to read them to use, to
change or to understand the ray tracer.

Each one says which plain class it stands in for, and runs only while neither that class nor one of the handout's
methods was replaced (``stand_ins``).
"""
