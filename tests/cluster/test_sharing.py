"""Sums in a tree: the same bits for any division of the samples, any order and any tree; without processes."""

from types import SimpleNamespace

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.cluster import parcels_of
from taichi_tracer.cluster.child import Desk, samples_of
from taichi_tracer.cluster.sharing import check_adaptive, passes

WHICH = (0, 0, None)
OPTIONS = {"scene": "cube", "estimator": "brdf", "intersector": "brute_force", "size": (12, 8), "arch": "cpu"}


@pytest.fixture
def desk(tmp_path):
    """What a worker has in its process, in this one."""
    start("f32")
    made = Desk(str(tmp_path), None)
    yield made
    made.close()


@pytest.mark.long
def test_any_tree_of_any_ranges_gives_the_bits_of_one_process(desk):
    """Ranges of several lengths, one of them done twice; sums of sums, as workers make them."""
    (parcel,), _ = parcels_of([OPTIONS])
    desk.receive(parcel.message(), {})
    cuts = [0, 1, 4, 5, 11, 12]
    done = [desk.render(parcel.id, WHICH, a, b - a) for a, b in zip(cuts, cuts[1:], strict=False)]
    assert [part["ranges"] for part in done] == [[[a, b]] for a, b in zip(cuts, cuts[1:], strict=False)]
    again = desk.render(parcel.id, WHICH, 4, 1)
    for name, array in done[2]["arrays"].items():
        np.testing.assert_array_equal(again["arrays"][name], array)
    merge = lambda *parts: desk.merge(parcel.id, WHICH, list(parts))  # noqa: E731
    trees = [merge(merge(*done[:2]), merge(*done[2:])), merge(done[0], merge(merge(done[1], again), merge(*done[3:])))]
    renderer = desk.renderer_of(parcel.id, WHICH)
    film = renderer.film.alike()
    renderer.first_sample = 0
    renderer.begin()
    alone = renderer.render(12).image()
    for tree in trees:
        assert tree["ranges"] == [[0, 12]]
        assert samples_of(tree) == 12
        film.from_arrays(tree["arrays"], 12)
        np.testing.assert_array_equal(film.image(), alone)
    with pytest.raises(tt.InputError, match="samples 4 to 4 are in both: each may count once"):
        merge(done[2], again)


@pytest.mark.parametrize(("spp", "mean", "count"), [(1, 1.0, 1), (37, 1.0, 37), (37, 0.5, 74), (4, 0.3, 14)])
def test_so_many_passes_give_a_pixel_its_samples_on_average(spp, mean, count):
    assert passes(spp, mean) == count


def test_adaptive_pictures_need_a_sampler_whose_error_is_no_doubling():
    check_adaptive(True, SimpleNamespace(name="niederreiter_two", doubles=False))
    check_adaptive(False, SimpleNamespace(name="niederreiter", doubles=True))
    with pytest.raises(tt.InputError, match="different numbers of samples: go on without a cluster"):
        check_adaptive(False, SimpleNamespace(name="niederreiter", doubles=True), True)
    with pytest.raises(tt.InputError, match="--adaptive with --sampler niederreiter on a cluster: its error"):
        check_adaptive(True, SimpleNamespace(name="niederreiter", doubles=True))
