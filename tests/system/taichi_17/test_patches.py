"""The table of what is replaced: nothing at an import, only what fits, only what is wanted, and no picture changes."""

import pytest

from taichi_tracer.system.taichi_17 import patches
from taichi_tracer.system.taichi_17.patches import NAMES, PATCHES

# ── which are wanted


# ── which fit


@pytest.mark.parametrize("patch", PATCHES, ids=NAMES)
def test_every_patch_fits_the_taichi_that_is_installed(patch, monkeypatch):
    """Its parameters are those of Taichi's own names, also where another patch has replaced them."""
    assert patches.why_not(patch) == ""


# ── when they are replaced


# ── what they change
