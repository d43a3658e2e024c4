"""The grading of a class: submissions, isolated processes that run them, marks, and pages for the teacher.

A file has one step; what a submission computes is judged outside of its process. Add another report of marks as a new
file, like ``gradescope.py`` and ``class_page.py``.
"""
