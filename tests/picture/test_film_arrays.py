"""Films as arrays: there and back to the last bit, and the files of earlier versions."""

import numpy as np
import pytest
from support import long_except

from taichi_tracer.picture.film import Film
from taichi_tracer.system import runtime


@pytest.mark.parametrize("keeps_deviation", long_except([False, True], True))
def test_old_checkpoints_stay_readable_to_the_last_bit(precision, rng, keeps_deviation):
    """The layout of checkpoint files, version 1: total, rest, odd total, odd rest, deviation; all samples, odd ones."""
    shape, dtype = (3, 2), runtime.dtype()
    n_even, n_odd = rng.integers(1, 9, shape, np.int32), rng.integers(1, 9, shape, np.int32)
    n_even[1, 1] = n_odd[1, 1] = 0
    even, odd = rng.lognormal(size=(2, *shape, 3)).astype(dtype)
    rests = rng.normal(0, 1e-9, (2, *shape, 3)).astype(dtype)
    deviation = [rng.lognormal(size=(*shape, 3)).astype(dtype)] if keeps_deviation else []
    non_finite = np.zeros((17, 3), np.int32)
    non_finite[:3] = [[2, 0, 0], [2, 1, 4], [0, 1, 7]]
    arrays = {
        "values": np.stack([even, rests[0], odd, rests[1], *deviation], axis=2),
        "counts": np.stack([n_even + n_odd, n_odd], axis=2),
        "non_finite": non_finite,
    }
    film = Film(*shape, replicated=True, keeps_deviation=keeps_deviation)
    film.from_arrays(arrays, 9)
    assert film.samples == 9
    assert film.non_finite_samples() == [(2, 1, 4), (0, 1, 7)]
    np.testing.assert_array_equal(film.counts(), n_even + n_odd)
    mean = (even + odd) / np.maximum(n_even + n_odd, 1).astype(dtype)[..., None]
    mean[1, 1] = 0  # no samples: nothing was shown there
    np.testing.assert_array_equal(film.image(), mean.transpose(1, 0, 2)[::-1].astype(np.float32))
    written = film.to_arrays()
    assert list(written) == ["values", "counts", "non_finite"]
    for name, array in arrays.items():
        assert (written[name].dtype, written[name].shape) == (array.dtype, array.shape)
        assert written[name].tobytes() == array.tobytes()


def test_old_checkpoints_of_independent_samples_stay_readable_to_the_last_bit(precision, rng):
    """The same without halves: total, rest, deviation; all samples, and 0 in place of the odd ones."""
    shape, dtype = (3, 2), runtime.dtype()
    counts = np.zeros((*shape, 2), np.int32)
    counts[..., 0] = rng.integers(2, 9, shape)
    values = rng.lognormal(size=(*shape, 3, 3)).astype(dtype)
    film = Film(*shape)
    film.from_arrays({"values": values, "counts": counts, "non_finite": np.zeros((17, 3), np.int32)}, 8)
    n = counts[..., :1].astype(dtype)
    np.testing.assert_array_equal(film.canvas.to_numpy(), values[:, :, 0] / n)
    variance = (values[:, :, 2] / (n * (n - 1))).transpose(1, 0, 2)[::-1]
    np.testing.assert_allclose(film.variance_of_mean(), variance, rtol=1e-6)
    written = film.to_arrays()
    assert written["values"].dtype == dtype
    assert written["values"].tobytes() == values.tobytes()
    assert written["counts"].tobytes() == counts.tobytes()
