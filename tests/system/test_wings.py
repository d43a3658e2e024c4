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


def test_every_wing_is_a_folder_of_the_package():
    for folder in wings.WINGS:
        assert (wings.PACKAGE / folder / "__init__.py").is_file()
        assert wings.is_there(folder)
        assert wings.is_there(f"{folder}.part")


def test_a_module_of_a_wing_is_found():
    assert wings.wing("rt3.document").read_rt3.__name__ == "read_rt3"


def test_a_missing_wing_is_one_line_with_what_it_does(without):
    assert not wings.is_there("rt3.document")
    with pytest.raises(InputError) as error:
        wings.wing("rt3.document", "scene.xml")
    told = "scene.xml: this installation has no taichi_tracer/rt3, which reads and renders scene files of RT3"
    assert str(error.value) == told
    assert isinstance(error.value, ImportError)


@pytest.mark.parametrize("name", ["numpy", "taichi_tracer.camera", "taichi_tracer", None])
def test_another_module_that_is_missing_is_no_wing(without, monkeypatch, name):
    def broken(_):
        raise ModuleNotFoundError("missing", name=name)

    monkeypatch.setattr(wings, "import_quickly", broken)
    with pytest.raises(ModuleNotFoundError, match="^missing$") as error:
        wings.wing("fast.plan")
    assert wings.missing_wing(error.value) is None
    assert wings.missing_wing(ValueError()) is None


def test_a_file_of_the_package_is_always_there(without):
    assert wings.is_there("camera")
