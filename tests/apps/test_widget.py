"""``tt.show``: a widget that sends frames as long as the page shows them."""

import sys

import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.system.errors import InputError


@pytest.fixture(scope="module")
def scene():
    start("f32")
    return tt.load_scene_data("cube")


def test_without_anywidget_one_line_says_what_to_install(scene, monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(InputError, match=r"pip install 'taichi_tracer\[notebook\]'"):
        tt.show(scene)
