"""Fast forms of the plain classes, with the same bits. You can use, change and understand the ray tracer without them.

Each fast form names the plain class for which it stands in. It runs only as long as neither this class nor one of the
handout's methods was replaced (``stand_ins``).
"""
