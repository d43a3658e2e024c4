"""Sums in a tree: the same bits for any division of the samples, any order and any tree; without processes."""

from types import SimpleNamespace

import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.cluster.child import Desk
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
