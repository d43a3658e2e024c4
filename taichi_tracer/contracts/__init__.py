"""What every part of a kind must do, as numbers that are compared: for ``taichi-tracer check-part``, and for the tests.

Each file has the checks of one kind. A check raises an AssertionError that says the first wrong number.
"""
