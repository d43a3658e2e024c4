"""A picture while it is rendered: its samples, its error, when it ends, and how it is stored.

A file has one task of the picture, such as the film, the error estimate or checkpoints. Add another quantity per pixel
to ``aovs.py``, another measure of difference to ``metrics.py``, and another task as a new file.
"""
