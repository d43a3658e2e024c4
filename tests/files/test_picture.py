"""A picture knows whether it is light, wherever a program takes it; what is computed from it otherwise is plain."""

import copy
import io
import pickle

import numpy as np
import pytest
from PIL import Image

from taichi_tracer.files.picture import Picture

VALUES = np.arange(24, dtype=np.float32).reshape(2, 4, 3) / 24

SAME = {
    "slice": lambda p: p[::-1, 1:3],
    "row": lambda p: next(iter(p)),
    "copy": lambda p: p.copy(),
    "copy.deepcopy": copy.deepcopy,
    "pickle": lambda p: pickle.loads(pickle.dumps(p)),
    "astype": lambda p: p.astype(np.float64),
    "reshape": lambda p: p.reshape(-1, 3),
    "exposure": lambda p: 0.5 * p,
    "sum": lambda p: p + p,
    "difference": lambda p: np.abs(p - p[:, ::-1]),
    "clip": lambda p: np.clip(p, 0.1, 0.5),
    "grey": lambda p: p.mean(axis=2),
    "nan_to_num": np.nan_to_num,
    "hstack": lambda p: np.hstack([p, p]),
    "concatenate": lambda p: np.concatenate([p, np.zeros((1, 4, 3))], axis=0),
    "where": lambda p: np.where(np.arange(4)[:, None] < 2, p, 2 * p),
    "pad": lambda p: np.pad(p, ((1, 1), (1, 1), (0, 0))),
    "repeat": lambda p: np.repeat(p, 3, axis=0),
}
PLAIN = {
    "encoded by hand": lambda p: p ** (1 / 2.2),
    "square root": np.sqrt,
    "mask": lambda p: p > 0.5,
    "where black": lambda p: (p == 0).all(axis=2),
    "asarray": np.asarray,
    "NaN": np.isnan,
}


@pytest.mark.parametrize("operation", SAME)
@pytest.mark.parametrize("srgb", [True, False])
def test_these_know_the_same(operation, srgb):
    found, expected = SAME[operation](Picture(VALUES, srgb)), SAME[operation](VALUES)
    assert isinstance(found, Picture)
    assert found.srgb is srgb
    assert found.dtype == expected.dtype
    np.testing.assert_array_equal(np.asarray(found), expected)


@pytest.mark.parametrize("operation", PLAIN)
def test_these_are_plain(operation):
    found = PLAIN[operation](Picture(VALUES, True))
    assert type(found) is np.ndarray
    np.testing.assert_array_equal(found, PLAIN[operation](VALUES))


def test_single_numbers_are_numbers():
    picture = Picture(VALUES, True)
    for found in (picture.mean(), picture.max(), picture[0, 0, 1], picture.std(), np.linalg.norm(picture)):
        assert isinstance(found, np.float32)
    assert picture.tolist() == VALUES.tolist()


def test_pictures_that_do_not_agree_have_no_common_meaning():
    light, data = Picture(VALUES, True), Picture(VALUES, False)
    assert type(light + data) is np.ndarray
    assert np.hstack([light, data]).srgb is None


def test_in_place_operations_know_what_they_did():
    picture = Picture(VALUES.copy(), True)
    picture *= 2
    assert picture.srgb is True
    picture **= 0.5
    assert picture.srgb is None
    np.testing.assert_allclose(picture, np.sqrt(2 * VALUES), rtol=1e-6)


def test_it_shares_the_memory_of_its_array():
    values = VALUES.copy()
    Picture(values, True)[0, 0] = 9
    assert values[0, 0].tolist() == [9, 9, 9]


@pytest.mark.parametrize(("srgb", "byte"), [(True, 188), (False, 128)])
def test_a_notebook_shows_it_as_a_picture_and_a_few_pixels_as_numbers(srgb, byte):
    picture = Picture(np.full((16, 20, 3), 0.5), srgb)
    with Image.open(io.BytesIO(picture._repr_png_())) as shown:
        assert shown.size == (20, 16)
        assert shown.getpixel((3, 3)) == (byte, byte, byte)
    assert picture[:, :3]._repr_png_() is None
    assert picture[..., 0]._repr_png_() is None
