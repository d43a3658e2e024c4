"""Light that no sample of a picture has met: a bound for the upper end of its error.

A file has one reason why samples miss light, such as small lamps or caustics, and estimates how much. Add a reason as a
new file, and call it in ``unseen_light.py``.
"""
