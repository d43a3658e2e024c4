"""``tt.show``: a widget that sends frames as long as the page shows them."""

import asyncio
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


def test_what_cannot_be_shown_is_an_error():
    pytest.importorskip("anywidget")
    with pytest.raises(InputError, match="show takes a scene or a renderer, not 'cube'"):
        tt.show("cube")


def test_outside_a_notebook_it_says_so(scene):
    pytest.importorskip("anywidget")
    with pytest.raises(InputError, match="show needs a notebook"):
        tt.show(scene)


@pytest.mark.long
def test_frames_are_sent_while_they_are_shown(scene):
    pytest.importorskip("anywidget")

    from taichi_tracer.apps import live_picture as module

    async def watch():
        renderer = tt.A1Renderer(scene, 24, 16).use("normal")
        picture = tt.show(renderer)
        sent = []
        picture.send = lambda content, buffers: sent.append((content, bytes(buffers[0])))
        picture._handle_custom_msg({"type": "ack", "id": 0}, [])
        await until(lambda: sent and sent[-1][0]["kind"] == "png")
        assert (sent[0][0]["width"], sent[-1][0]["view"]) == (24, "normal")  # the size comes with the first frame alone
        assert sent[-1][1].startswith(b"\x89PNG")

        unshown = len(sent)  # nothing was acknowledged since
        for k in range(20):
            picture._handle_custom_msg({"type": "drag", "dx": 0.01 * k, "dy": 0}, [])
            await asyncio.sleep(0.01)
        assert len(sent) - unshown <= module.IN_FLIGHT

        picture._handle_custom_msg({"type": "ack", "id": sent[-1][0]["id"]}, [])
        picture._handle_custom_msg({"type": "use", "what": "view", "name": "hit"}, [])
        await until(lambda: sent[-1][0]["view"] == "hit")
        picture._handle_custom_msg({"type": "save", "kind": "png"}, [])
        assert next(data for content, data in sent if content.get("file") == "picture.png").startswith(b"\x89PNG")
        sent[:] = [one for one in sent if "file" not in one[0]]

        picture._handle_custom_msg({"type": "fov", "value": "wide"}, [])
        assert "must be a finite number" in picture.session.message
        found = picture._repr_mimebundle_()
        assert "image/png" in (found[0] if isinstance(found, tuple) else found)
        picture.close()

    asyncio.run(watch())


async def until(condition, most=2000):
    """Let other tasks run until a condition holds."""
    for _ in range(most):
        if condition():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("it did not happen")
