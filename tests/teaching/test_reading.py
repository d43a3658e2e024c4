"""Students' files in several encodings; imports of the kit; helpers whose names the package has already."""

import pytest

from taichi_tracer.camera import Camera
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.loading import load_submission, solution_of
from taichi_tracer.teaching.reading import compiled, module_of, taken_name, values_of
from taichi_tracer.teaching.running import answer

CODE = 'NAME = "Grün"\n'
# Words that a student might give to a helper of a camera; which of them are taken follows from the package.
WORDS = """
aspect aspect_ratio ratio tangent tan_half half_height half_width half_size centre center corner corners pixel
pixels pixel_centre to_ndc from_ndc ndc scale scaled offset shift basis axes axis x_axis y_axis z_axis x y z right
up_vector forward look look_at direction dir ray rays origin position matrix rotation translation view projection
inverse transpose normalize normalized normalise unit length norm cross dot lerp mix clamp saturate size resolution
film plane window left top bottom near far focal focus distance radius angle angles radians degrees theta phi fovy
fovx half_fov random jitter sample samples uniform noise seed index row column x_coord y_coord u v w u_vec v_vec
helper compute get set update reset build make create evaluate value values data numbers temp tmp result output
input debug test check width_of height_of image_width image_height to_world to_camera to_screen screen screen_x
screen_y dx dy du dv step delta half quarter double square cube power root sine cosine tan arctan degrees_to_radians
rad deg deg2rad normal tangent_vector binormal frame local world camera lens aperture eye_position at_position gaze
up_direction first second third one two three point points line segment edge edges area volume weight weights mean
average total sum_of minimum maximum sign is_valid is_inside is_behind has_hit flip mirror rotate translate
transform project unproject pack unpack
"""
HELPERS = WORDS.split()


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_a_mark_before_utf_8_is_no_fault(tmp_path, encoding):
    (tmp_path / f"of_{encoding}.py").write_bytes(CODE.encode(encoding))
    assert module_of(tmp_path / f"of_{encoding}.py").NAME == "Grün"


def test_the_first_line_names_an_encoding(tmp_path):
    (tmp_path / "old_file.py").write_bytes(f"# coding: latin-1\n{CODE}".encode("latin-1"))
    assert module_of(tmp_path / "old_file.py").NAME == "Grün"


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16"])
def test_other_encodings_are_told(tmp_path, encoding):
    (tmp_path / "a.py").write_bytes(CODE.encode(encoding))
    with pytest.raises(SyntaxError, match="not in UTF-8: save it so"):
        compiled(tmp_path / "a.py")


def test_wrong_python_is_told_as_python_does(tmp_path):
    (tmp_path / "a.py").write_text("def f(:\n")
    with pytest.raises(SyntaxError) as caught:
        compiled(tmp_path / "a.py")
    assert caught.value.lineno == 1


@pytest.mark.parametrize(
    "line",
    [
        "from taichi_tracer.teaching import catalogue, running",
        "import taichi_tracer.teaching.running as r",
        "from taichi_tracer.teaching.catalogue import load",
        "def f():\n    from taichi_tracer.teaching import judges",
    ],
)
def test_the_kit_cannot_be_imported(tmp_path, line):
    (tmp_path / "a.py").write_text(line)
    with pytest.raises(InputError, match="belongs to the kit"):
        compiled(tmp_path / "a.py")
    (tmp_path / "a.py").write_text("from taichi_tracer.teaching import not_written\nimport taichi_tracer as tt\n")
    assert compiled(tmp_path / "a.py")


def test_a_helper_with_a_taken_name_is_told():
    """Every name that a camera has as a value is found, among 200 plausible ones too."""
    camera = Camera(4, 4)
    for name in {*HELPERS, *vars(camera)}:
        found = taken_name(type("Own", (Camera,), {}), {name})
        assert (found is not None) == (name in vars(camera) or name in values_of(found[1] if found else Camera)), name
    assert {"centre", "half_size", "x"} <= set(vars(camera))
    assert len(HELPERS) >= 200


def test_a_part_with_such_a_helper_says_so(tmp_path):
    assignment = catalogue.load("a1")
    source = (assignment.solution_folder / "camera.py").read_text()
    method = "    def centre(self):\n        return 0\n\n"
    at = source.index("    @", source.index("class "))
    (tmp_path / "camera.py").write_text(source[:at] + method + source[at:])
    part = assignment.part("Camera.generate_ndc_coords")
    student = load_submission(tmp_path, assignment)
    found = answer(part, student, solution_of(assignment), assignment.inputs(part, 1), dict(assignment.classes))
    assert found.status == "crashed"
    assert "has a value of the name centre" in found.message


def test_methods_that_do_nothing_are_not_written(tmp_path):
    assignment = catalogue.load("a1")
    for body in ("pass", "return", "return None", '"""Compute it."""'):
        (tmp_path / "camera.py").write_text(
            f"import taichi_tracer as tt\n\n\nclass Camera(tt.Camera):\n    def compute_matrix(self):\n        {body}\n"
        )
        part = assignment.part("Camera.compute_matrix")
        student = load_submission(tmp_path, assignment)
        found = answer(part, student, solution_of(assignment), assignment.inputs(part, 1), dict(assignment.classes))
        assert found.status == "not written", body
