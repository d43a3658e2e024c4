"""Raw arrays beside a picture: their names, and what an EXR file can hold of them."""

import numpy as np
import pytest

from taichi_tracer.picture.aovs import AOVS, LARGEST_ID, as_channels, channel_names, find_aovs
from taichi_tracer.system.errors import InputError


def test_names_are_found_once_each_and_a_single_one_is_a_list_of_one():
    assert [aov.name for aov in find_aovs(["normal", "distance", "normal"])] == ["normal", "distance"]
    assert find_aovs("distance") == (AOVS["distance"],)
    assert channel_names(find_aovs(("distance", "normal"))) == ["Z", "N.X", "N.Y", "N.Z"]
    with pytest.raises(InputError, match="unknown AOV 'norml': did you mean 'normal'"):
        find_aovs(["norml"])


def test_no_two_channels_have_the_same_name():
    names = channel_names(tuple(AOVS.values()))
    assert len(set(names)) == len(names)
    assert not set(names) & set("RGB")


def test_channels_are_the_components():
    values = np.arange(24.0).reshape(2, 4, 3)
    found = as_channels(AOVS["position"], values)
    assert list(found) == ["P.X", "P.Y", "P.Z"]
    np.testing.assert_array_equal(np.dstack(list(found.values())), values)
    assert as_channels(AOVS["distance"], values[..., 0])["Z"].shape == (2, 4)


def test_ids_that_float32_does_not_have_are_refused():
    ids = np.array([[LARGEST_ID, -1]], np.int32)
    assert np.float32(as_channels(AOVS["triangle_id"], ids)["triangle_id"]).tolist() == ids.tolist()
    with pytest.raises(InputError, match="16777217 is more than 16777216, the largest id in an EXR: save it by numpy"):
        as_channels(AOVS["triangle_id"], ids + 1)
