"""The programs of the assignments, as a student starts them: a picture, or the names of what is not written."""

import numpy as np
import pytest
from desktop import TIME_OUT, Desktop, opened, poll

from taichi_tracer.apps.viewer import PANEL
from taichi_tracer.files.srgb import to_bytes
from taichi_tracer.teaching import catalogue, checkerboard
from taichi_tracer.teaching.handing_out import write_folder

NAME, SIZE = "rt3", (512, 512)
STUBS = ["PerspectiveCamera.compute_matrix", "PerspectiveCamera.pixel_to_screen", "PerspectiveCamera.generate_ray"]
pytestmark = pytest.mark.slow


class Program(Desktop):
    """An assignment's program in its window."""

    def picture(self):
        """(h, w, 3) pixels of the picture beside the panel."""
        self.measure()
        return self.window()[:, PANEL:]

    def close(self):
        """Press Escape; the exit code."""
        self.xdotool("key", "Escape")
        return self.process.wait(timeout=TIME_OUT)


def program_of(folder, is_solved):
    """The program of an assignment."""
    assignment = catalogue.load(NAME)
    write_folder(assignment, folder, is_solved)
    return opened([assignment.program], folder, Program)


def shows_no_board(shown):
    """Whether most of a picture has light, and other colours than the two greys of the checkerboard."""
    is_grey = np.ptp(shown, axis=2) <= 1
    is_board = is_grey & np.isin(shown[..., 0], np.unique(boards_greys()))
    return is_board.mean() < 0.2 and (shown.max(axis=2) > 20).mean() > 0.3


def boards_greys():
    """The greys of a checkerboard, as views and as light."""
    greys = np.array([checkerboard.DARK, checkerboard.LIGHT]) / 255
    return np.concatenate([to_bytes(greys.reshape(1, 2, 1), srgb).ravel() for srgb in (False, True)])


def test_the_solved_program_shows_its_picture(tmp_path):
    with program_of(tmp_path / NAME, is_solved=True) as program:
        poll(lambda: shows_no_board(program.picture()), "a picture")
        assert program.close() == 0
        assert "Traceback" not in program.log.read_text()


def test_the_students_program_shows_what_is_not_written(tmp_path):
    """A checkerboard with the names of the methods, to the last bit; and it is none that counts as a picture."""
    board = to_bytes(checkerboard.board(*SIZE, tuple(STUBS)).swapaxes(0, 1)[::-1], False).astype(int)
    with program_of(tmp_path / NAME, is_solved=False) as program:
        poll(lambda: abs(program.picture() - board).max() <= 1, f"the checkerboard with {', '.join(STUBS)}")
        assert not shows_no_board(program.picture())
        assert program.close() == 0
