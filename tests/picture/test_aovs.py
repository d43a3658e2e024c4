"""Raw arrays beside a picture: their names, and what an EXR file can hold of them."""

import numpy as np

from taichi_tracer.picture.aovs import AOVS, as_channels, channel_names


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
