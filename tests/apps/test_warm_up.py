"""What was rendered once is kept: the same picture in a new process compiles nothing."""

from argparse import Namespace

from taichi_tracer.apps import warm_up
from taichi_tracer.apps.names import find_views


def asked(**options):
    return warm_up.pictures(Namespace(**{"scenes": None, "assignments": False, "all": False, "size": None} | options))


def test_every_picture_is_one_that_render_knows():
    for options in ({}, {"all": True}, {"scenes": ["cube"], "size": [(8, 8), (16, 8)]}):
        pictures = asked(**options)
        assert len(set(pictures)) == len(pictures) > 5
        for _, name, _ in pictures:
            assert len(find_views(name)) == 1
    assert {size for _, _, size in pictures} == {(8, 8), (16, 8)}
