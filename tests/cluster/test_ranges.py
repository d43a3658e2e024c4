"""The book of sample ranges: every sample counts once, in its order, whatever happens to the workers."""

import numpy as np
import pytest

from taichi_tracer.cluster.ranges import Ledger


@pytest.mark.parametrize("seed", range(8))
def test_every_sample_counts_once_whatever_gets_lost_or_comes_twice(seed):
    """Workers take, lose, repeat and finish ranges in a random order; results are lost before they are collected."""
    rng = np.random.default_rng(seed)
    book, counted, results = Ledger(3, 103), np.zeros(200, int), []
    for _ in range(10_000):
        worker, action = f"w{rng.integers(4)}", rng.integers(6)
        given = sorted(book.given)
        if action == 0:
            book.take(worker, int(rng.integers(1, 9)))
        elif action == 1 and given:
            book.take_also(worker, given[0])
        elif action == 2 and given:
            one = given[rng.integers(len(given))]
            book.lose(one, next(iter(book.given[one])))
        elif action == 3 and given:
            one = given[rng.integers(len(given))]
            assert book.finish(one, worker)
            results.append(one)
            assert not book.finish(one, "again")  # a second result does not count
        elif action == 4 and book.done and rng.random() < 0.3:
            book.undo(next(iter(book.done)))
        elif action == 5:
            ready = book.ready()
            for first, end in ready:
                counted[first:end] += 1
            book.collect(ready)
        if book.collected == 103:
            break
    assert book.collected == 103
    np.testing.assert_array_equal(counted[3:103], 1)
    assert counted.sum() == 100
    assert book.left == 0
    assert book.is_given


def test_only_what_follows_without_a_gap_is_ready():
    book = Ledger(0, 9)
    first, second, third = (book.take(w, 3) for w in "abc")
    book.finish(second, 2)
    assert book.ready() == []
    book.finish(first, 1)
    assert book.ready() == [first, second]
    with pytest.raises(ValueError, match="do not follow"):
        book.collect([second])
    book.collect([first, second])
    assert book.collected == 6
    assert third == (6, 9)
