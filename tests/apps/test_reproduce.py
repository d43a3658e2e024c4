"""The lines of Python that are told make the same pixels."""

from support import start

import taichi_tracer as tt
from taichi_tracer.apps.reproduce import as_python

SIZE = (16, 12)


def test_what_no_text_can_say_is_told():
    start("f32")

    class Own(tt.Camera):
        """A student's."""

    renderer = tt.A1Renderer(tt.load_scene_data("cube", background=(1, 0, 0)), *SIZE, camera=Own)
    told = as_python(renderer)
    assert "# the camera 'perspective' is an object of your own program: add it" in told
    assert "# the background is an object of your own program" in told
