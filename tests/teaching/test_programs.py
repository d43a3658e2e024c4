"""The programs of the assignments, as a student starts them: a picture, or the names of what is not written."""

import math

import numpy as np
import pytest
from desktop import TIME_OUT, Desktop, opened, poll
from taichi_tracer.apps.screen import SHARE_OF_SCREEN, Layout

from taichi_tracer.files.srgb import to_bytes
from taichi_tracer.teaching import catalogue, checkerboard
from taichi_tracer.teaching.handing_out import write_folder

SIZES = {"a3": (768, 384)}  # of the picture; (512, 512) of the others
SHADES = {"a1": False, "rt3": False}  # whether the picture is radiance, which a window shows with the sRGB curve
STUBS = {  # what the first picture of a program needs
    "a1": [
        "Camera.generate_ndc_coords",
        "Camera.generate_camera_coords",
        "Camera.compute_matrix",
        "Camera.generate_ray",
        "RayIntersector.intersect_triangle",
        "RayIntersector.query_ray",
        "A1Renderer.shade_normal",
    ],
    "a2": [
        "Camera.generate_ndc_coords",
        "Camera.generate_ray",
        "A2Renderer.running_mean",
        "A2Renderer.shade_ray",
        "Environment.query_ray",
    ],
    "a3": [
        "A3Renderer.to_solid_angle",
        "A3Renderer.power_heuristic",
        "A3Renderer.shade_ray",
        "MeshLightSampler.compute_triangle_area",
        "MeshLightSampler.compute_cdf",
        "MeshLightSampler.sample_emissive_triangle",
        "MeshLightSampler.evaluate_probability",
        "MeshLightSampler.sample_mesh_lights",
    ],
    "a4": ["A4Renderer.next_throughput", "A4Renderer.play_roulette", "A4Renderer.sample_light", "A4Renderer.shade_ray"],
    "rt3": ["PerspectiveCamera.compute_matrix", "PerspectiveCamera.pixel_to_screen", "PerspectiveCamera.generate_ray"],
    "rt3_lights": [
        "BlinnPhong.highlight",
        "BlinnPhong.shade",
        "BlinnPhong.radiance",
        "AmbientLight.reflected",
        "DirectionalLight.sample",
        "PointLight.sample",
        "SpotLight.share",
        "SpotLight.sample",
    ],
}
ONE_LONG = [
    pytest.param("rt3", marks=pytest.mark.slow),
]


class Program(Desktop):
    """An assignment's program in its window."""

    size = (512, 512)

    def picture(self):
        """(h, w, 3) pixels of the picture between the panels."""
        self.measure()
        layout = Layout.of((self.width, self.height), self.size)
        top = layout.height - layout.y - layout.shown_height
        return self.window()[top:][: layout.shown_height, layout.x :][:, : layout.shown_width]

    def close(self):
        """Press Escape; the exit code."""
        self.xdotool("key", "Escape")
        return self.process.wait(timeout=TIME_OUT)


def program_of(name, folder, is_solved):
    """The program of an assignment, on a screen where its window shows each pixel of the picture as one pixel."""
    assignment = catalogue.load(name)
    write_folder(assignment, folder, is_solved)
    size = SIZES.get(name, (512, 512))
    kind = type("Program", (Program,), {"size": size})
    return opened([assignment.program], folder, kind, f"1600x{math.ceil(size[1] / SHARE_OF_SCREEN[1])}x24")


def board_of(name, names):
    """(h, w, 3) what the window shows while these methods are not written."""
    board = checkerboard.board(*SIZES.get(name, (512, 512)), tuple(names))
    return to_bytes(board.swapaxes(0, 1)[::-1], SHADES.get(name, True)).astype(int)


def shows_no_board(shown):
    """Whether most of a picture has light, and other colours than the two greys of the checkerboard."""
    is_grey = np.ptp(shown, axis=2) <= 1
    is_board = is_grey & np.isin(shown[..., 0], np.unique(boards_greys()))
    return is_board.mean() < 0.2 and (shown.max(axis=2) > 20).mean() > 0.3


def boards_greys():
    """The greys of a checkerboard, as views and as light."""
    greys = np.array([checkerboard.DARK, checkerboard.LIGHT]) / 255
    return np.concatenate([to_bytes(greys.reshape(1, 2, 1), srgb).ravel() for srgb in (False, True)])


@pytest.mark.parametrize("name", ONE_LONG)
def test_the_solved_program_shows_its_picture(name, tmp_path):
    with program_of(name, tmp_path / name, is_solved=True) as program:
        poll(lambda: shows_no_board(program.picture()), "a picture")
        assert program.close() == 0
        assert "Traceback" not in program.log.read_text()


@pytest.mark.parametrize("name", ONE_LONG)
def test_the_students_program_shows_what_is_not_written(name, tmp_path):
    """A checkerboard with the names of the methods, to the last bit; and it is none that counts as a picture."""
    board = board_of(name, STUBS[name])
    with program_of(name, tmp_path / name, is_solved=False) as program:
        poll(lambda: abs(program.picture() - board).max() <= 1, f"the checkerboard with {', '.join(STUBS[name])}")
        assert not shows_no_board(program.picture())
        assert program.close() == 0
