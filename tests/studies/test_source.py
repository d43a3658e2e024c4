"""Where the scenes of a study come from: another process, or the caller where only the caller has what is needed."""

import pytest
import taichi as ti
from made_up_study import made_study

import taichi_tracer as tt
from taichi_tracer.studies.source import SceneFacts, comparable, lives_here_alone
from taichi_tracer.studies.variants import Variant, plan
from taichi_tracer.system.registry import PARTS


def test_what_cannot_be_compared_in_a_scene_is_left_out_and_named():
    few = SceneFacts("box", "box.obj", "a machine", 0, False, 200_000, 0.4)
    kept, notes = comparable(plan(), few)
    assert not any(variant.plain or variant.lookup != "nearest" for variant in kept)
    assert len(kept) == len(plan()) - 2
    assert notes[0].startswith("The plain forms are left out, because the scene has more than 100,000 primitives")
    assert notes[1] == "The scene has no environment, so that its look-up was not compared."
    assert comparable(plan(), made_study().facts) == (plan(), [])
    with pytest.raises(tt.InputError, match="box.obj has no surface with Ke > 0"):
        comparable([Variant(lamp_choice="area"), Variant(lamp_choice="power")], few)


def test_what_only_the_caller_has_stays_with_the_caller():
    assert not lives_here_alone()

    @tt.register
    class Still(tt.Sampler):
        """All samples are alike."""

        name = "still_here"

        @ti.func
        def get_2d(self, seed, pixel, index, dimension):  # pragma: no cover (never sampled)
            return ti.Vector([0.5, 0.5])

    part = PARTS.find("sampler", "still_here")
    try:
        assert lives_here_alone()
        assert not lives_here_alone([__file__])
    finally:
        PARTS.remove(part)
    assert not lives_here_alone()
