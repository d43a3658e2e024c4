"""RT3, the XML scene files of another course: reading, writing and rendering.

A file has one part of the format, such as lights, and methods that read its elements. Add an element as a method that
reads an ``Element``, and enter its tag in ``TAGS`` of ``document.py``.
"""
