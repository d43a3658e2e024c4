"""A tagged solution becomes a student's file: what is cut, what is put in its place, and which tags are errors."""

import pytest

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.handout.export import written

SOURCE = '''"""A file."""

import taichi_tracer as tt


class Camera:
    def f(self, x):
        """The task."""
        y = 0
        ### BEGIN SOLUTION
        y = x + 1
        ### END SOLUTION
        return y

    # BEGIN SOLUTION NO PROMPT
    def helper(self):
        return 1
    # END SOLUTION


def g():
    # BEGIN SOLUTION
    z = 3
    # END SOLUTION
    """ # BEGIN PROMPT
    z = ...
    """ # END PROMPT
    return z
'''


def test_the_stub_has_the_task_and_a_mark_and_nothing_of_the_solution():
    stub = written(SOURCE, "f.py", "stub")
    assert "x + 1" not in stub
    assert "helper" not in stub
    assert "z = 3" not in stub
    assert '"""The task."""' in stub
    assert '        # YOUR CODE HERE\n        tt.teaching.not_written("Camera.f")  # delete' in stub
    assert '    z = ...\n    tt.teaching.not_written("g")' in stub
    assert "SOLUTION" not in stub
    assert "PROMPT" not in stub
    compile(stub, "f.py", "exec")


def test_a_file_must_know_the_package_that_a_stub_calls():
    with pytest.raises(InputError, match="f.py: add 'import taichi_tracer as tt'"):
        written("def f():\n    # BEGIN SOLUTION\n    x = 1\n    # END SOLUTION\n", "f.py", "stub")


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("def f():\n    ### BEGIN SOLUTION\n    x = 1\n", "a.py:2: BEGIN SOLUTION without an END"),
        ("x = 1\n### END SOLUTION\n", "a.py:2: END SOLUTION without a BEGIN"),
        ("### BEGIN SOLUTION\nx = 1\n### BEGIN SOLUTION\nx = 2\n### END SOLUTION\n", "a.py:1: BEGIN SOLUTION without"),
        ('# BEGIN SOLUTION\nx = 1\n# END SOLUTION\n""" # BEGIN PROMPT\nx = 2\n"""\n', "a.py:4: BEGIN PROMPT without"),
    ],
)
def test_a_tag_without_its_partner_is_an_error_with_its_line(source, message):
    with pytest.raises(InputError, match=message):
        written(source, "a.py", "stub")
