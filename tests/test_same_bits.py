"""Every picture of ``pictures.py`` has the bits that it had when tests/references/make_pictures.py was run.

Where a change is meant to change pictures, that program makes the file anew.
"""

import json
from pathlib import Path

import pictures as catalogue
import pytest
from support import long_except, start

REFERENCE = json.loads((Path(__file__).parent / "references" / "pictures.json").read_text(encoding="utf-8"))
QUICK = catalogue.groups(lambda picture: picture.is_quick)
OTHERS = catalogue.groups(lambda picture: not picture.is_quick)


@pytest.fixture
def same_rounding(request):
    """Starts Taichi in a precision; skips where this machine rounds otherwise than the one that made the file."""

    def started(precision):
        start(precision)
        if catalogue.canary() != REFERENCE["canaries"][precision]:
            pytest.skip(f"sin, exp and the like round otherwise here than where pictures.json was made, in {precision}")

    return started


def compare(group):
    """Render a group and compare it with the file, telling all pictures that differ at once."""
    make = catalogue.Maker(group)
    found = {picture.name: catalogue.digest(make(picture)) for picture in group}
    make.destroy()
    assert found == {name: REFERENCE["pictures"][name] for name in found}


@pytest.mark.filterwarnings("ignore:nothing in this scene emits light")
@pytest.mark.parametrize("name", long_except(QUICK, *list(QUICK)[::3]))
def test_pictures_have_the_same_bits(same_rounding, name):
    same_rounding(QUICK[name][0].precision)
    compare(QUICK[name])


@pytest.mark.exhaustive
@pytest.mark.filterwarnings("ignore:nothing in this scene emits light")
@pytest.mark.parametrize("name", OTHERS)
def test_the_other_pictures_have_the_same_bits(same_rounding, name):
    same_rounding(OTHERS[name][0].precision)
    compare(OTHERS[name])


def test_every_picture_has_its_digest_under_its_own_name():
    names = [picture.name for picture in catalogue.pictures()]
    assert len(names) == len(set(names))
    assert set(names) == set(REFERENCE["pictures"])


def test_the_quick_pictures_show_every_scene_view_estimator_and_sampler():
    quick = [picture for group in QUICK.values() for picture in group]
    everything = list(catalogue.pictures())
    assert {p.scene for p in quick} == {p.scene for p in everything}
    assert {p.shows for p in quick} == {p.shows for p in everything}
    samplers = {p.options.get("sampler") for p in everything} - {None}
    assert {p.options.get("sampler") for p in quick} - {None} == samplers
