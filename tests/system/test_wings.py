"""Modules of folders that can be taken off."""

import pytest

from taichi_tracer.system import wings
from taichi_tracer.system.errors import InputError


@pytest.fixture
def without(monkeypatch, tmp_path):
    """A package of which every wing is missing, and no other file."""
    package = tmp_path / "taichi_tracer"
    package.mkdir()
    monkeypatch.setattr(wings, "PACKAGE", package)

    def refuse(name):
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)

    monkeypatch.setattr(wings, "import_quickly", refuse)


def test_a_missing_wing_is_one_line_with_what_it_does(without):
    assert not wings.is_there("rt3.document")
    with pytest.raises(InputError) as error:
        wings.wing("rt3.document", "scene.xml")
    told = "scene.xml: this installation has no taichi_tracer/rt3, which reads and renders scene files of RT3"
    assert str(error.value) == told
    assert isinstance(error.value, ImportError)
