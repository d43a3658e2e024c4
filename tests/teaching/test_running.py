"""Students' files in several encodings; imports of the kit; helpers whose names the package has already."""

import pytest

from taichi_tracer.course.files import parsed
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.running import answer, load_submission

CODE = 'NAME = "Grün"\n'


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16"])
def test_other_encodings_are_told(tmp_path, encoding):
    (tmp_path / "a.py").write_bytes(CODE.encode(encoding))
    with pytest.raises(SyntaxError, match="not in UTF-8: save it so"):
        parsed(tmp_path / "a.py")


def test_methods_that_do_nothing_are_not_written(tmp_path):
    assignment = catalogue.load("a1")
    for body in ("pass", "return", "return None", '"""Compute it."""'):
        (tmp_path / "camera.py").write_text(
            f"import taichi_tracer as tt\n\n\nclass Camera(tt.Camera):\n    def compute_matrix(self):\n        {body}\n"
        )
        part = assignment.part("Camera.compute_matrix")
        student = load_submission(tmp_path, assignment)
        found = answer(assignment, part, student, assignment.inputs(part, 1))
        assert found.status == "not written", body
