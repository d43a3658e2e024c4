"""Forms that are kept between processes run from the first sample on; others, when they would have paid."""

import math

import numpy as np
import pytest
from support import needs_lanes

import taichi_tracer as tt
from taichi_tracer.fast import kept_forms, plan, primary_hits
from taichi_tracer.fast.kept_forms import COMPILED, LONG, KeptForms, Least, key_of, key_of_packets
from taichi_tracer.system.trial import read, write

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """The forms of a machine where nothing was compiled."""
    fresh = KeptForms()
    monkeypatch.setattr(kept_forms, "cache_folder", lambda _: (tmp_path, None))
    monkeypatch.setattr(plan, "KEPT", fresh)
    monkeypatch.setattr(primary_hits, "KEPT", fresh)
    return fresh


def test_seconds_add_up_across_processes_until_the_form_is_compiled(kept, tmp_path):
    kept.add("mis", 3.0)
    other = KeptForms()
    other.add("mis", 2.5)
    other.add("path", 1.0)
    assert (other.seconds("mis"), other.seconds("path"), other.seconds("brdf")) == (5.5, 1.0, 0.0)
    other.add("mis", math.inf)
    kept.add("path", 1.0)
    assert (KeptForms().seconds("mis"), KeptForms().seconds("path")) == (math.inf, 2.0)
    assert read(tmp_path / kept_forms.FILE) == {"mis": COMPILED, "path": 2.0}


def test_the_newest_forms_are_remembered(kept, tmp_path, monkeypatch):
    monkeypatch.setattr(kept_forms, "MOST", 2)
    for name in ("a", "b", "c"):
        kept.add(name, 1.0)
    assert list(read(tmp_path / kept_forms.FILE)) == ["b", "c"]


def test_a_form_pays_sooner_where_it_is_kept_and_soonest_where_this_process_has_it(kept):
    least = Least(started=1, kept=2, new=3)
    assert kept.pay_from("mis", least) == 3
    kept.add("mis", LONG)
    assert kept.pay_from("mis", least) == 2
    kept.start("mis")
    assert (kept.pay_from("mis", least), kept.pay_from("brdf", least)) == (1, 3)
    assert KeptForms().pay_from("mis", least) == 2  # another process
    tt.init("cpu", force=True)
    assert kept.pay_from("mis", least) == 2


@pytest.mark.parametrize("content", ["", "[]", "{"])
def test_a_damaged_file_is_begun_anew(kept, tmp_path, content):
    (tmp_path / kept_forms.FILE).write_text(content)
    assert kept.seconds("mis") == 0
    kept.add("mis", 1.0)
    assert KeptForms().seconds("mis") == 1.0


def test_nothing_is_kept_where_no_folder_can_be_written(kept, monkeypatch):
    monkeypatch.setattr(kept_forms, "cache_folder", lambda _: (None, "read-only"))
    kept.add("mis", 1.0)
    assert kept.seconds("mis") == 0


def test_what_was_rendered_without_tiles_is_noted_until_they_would_have_paid(kept, tmp_path, monkeypatch):
    needs_lanes()
    monkeypatch.setattr(plan, "LEAST", Least(1, 1))
    monkeypatch.setattr(plan, "NOTED", 0.0)
    scene = tt.load_scene_data("torus_knot", environment="studio")
    renderer = tt.A3Renderer(scene, 16, 16).use("mis").render(4)
    key = key_of(renderer, renderer.kernel_scene(), renderer.active)
    seconds = kept.seconds(key)
    assert 0 < seconds < 4
    assert not renderer.plan.in_tiles
    renderer.render(4)
    assert kept.seconds(key) > seconds
    write(tmp_path / kept_forms.FILE, {key: LONG})
    kept._known = None
    again = tt.A3Renderer(scene, 16, 16).use("mis").render(4)
    assert again.plan.in_tiles
    assert KeptForms().seconds(key) == math.inf


def test_packets_are_used_sooner_where_they_are_kept_or_would_have_paid(kept, monkeypatch):
    needs_lanes()
    monkeypatch.setattr(plan, "NOTED", 0.0)
    monkeypatch.setattr(primary_hits, "LARGE_PICTURE", 256)
    monkeypatch.setattr(primary_hits, "MANY_RAYS", Least(1024, 1024, 1 << 25))
    monkeypatch.setattr(primary_hits, "CROWD", 1000)
    scene = tt.load_scene_data("sphere", environment="studio")
    first = tt.A3Renderer(scene, 16, 16).use("brdf").render(4)
    assert first.plan.compiled == {"plain"}
    key = key_of_packets(scene, first.camera, first.sampler)
    assert 0 < kept.seconds(key) < LONG
    kept.add(key, LONG)
    again = tt.A3Renderer(scene, 16, 16).use("brdf").render(4)
    assert again.plan.compiled == {True}
    assert kept.seconds(key) == math.inf
    np.testing.assert_array_equal(again.image(), first.image())
    assert tt.A3Renderer(scene, 16, 16).use("brdf").render(3).plan.compiled == {"plain"}  # 768 rays are soon traced
