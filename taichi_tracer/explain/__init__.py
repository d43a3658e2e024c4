"""The explanation of one pixel: every number on the way from the pixel to its colour.

A file has one stage: observed parts write a log, the log becomes a tree of steps, and the steps become text and
drawings. Add a number to ``recorded.py``, and its words to ``steps.py``.
"""
