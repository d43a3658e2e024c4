"""Checks of functions that a student has written, before a kernel is compiled of them.

A file has one kind of mistake: missing methods, forbidden statements, wrong types of results, or Taichi's own errors.
Add a mistake to the file of its kind; the message is one line, because Taichi prints many or ends the process.
"""
