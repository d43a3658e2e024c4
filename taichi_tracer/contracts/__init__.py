"""Checks that every part of a kind must pass, for ``taichi-tracer check-part`` and for the tests.

A file has the checks of one kind; a check raises an AssertionError that has the first wrong number. Add a check to the
file of its kind, and enter it in ``steps.py``.
"""
