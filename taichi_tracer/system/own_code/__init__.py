"""Checks of functions that a student has written, before a kernel is compiled of them, and Taichi's own errors.

A message is one line, because Taichi prints many or ends the process.
"""
