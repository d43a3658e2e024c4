"""The book of sample ranges: every sample counts once, in its order, whatever happens to the workers."""

import numpy as np
import pytest

from taichi_tracer.cluster.ranges import GROWTH, MOST, SECONDS, Ledger, next_power_of_two, size_of


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


def test_a_range_of_a_worker_that_has_gone_is_given_again_as_it_was():
    book = Ledger(0, None)
    one, other = book.take("a", 5), book.take("b", 7)
    book.lose(one, "a")
    assert book.take("b", 2) == one
    book.take_also("a", other)
    book.lose(other, "b")  # somebody else still has it
    assert book.take("b", 4) == (12, 16)


def test_without_an_end_nothing_is_ever_left_out():
    book = Ledger(10, None)
    assert book.left is None
    assert [book.take("a", 4) for _ in range(2)] == [(10, 14), (14, 18)]
    book.end = book.following  # the time is over
    assert book.take("a", 4) is None
    assert book.is_given


def test_ranges_of_one_sequence_end_at_its_doublings():
    book = Ledger(5, 69, zero=5, doubles=True)
    taken = [book.take("a", 100) for _ in range(8)]
    assert taken == [(5, 6), (6, 7), (7, 9), (9, 13), (13, 21), (21, 37), (37, 69), None]
    assert [next_power_of_two(n) for n in (0, 1, 2, 3, 4)] == [1, 2, 4, 4, 8]


@pytest.mark.parametrize(
    ("seconds", "last", "left", "workers", "until", "size"),
    [
        (None, 0, None, 1, None, 2),  # unknown: as few as can be
        (0.01, 100, None, 1, None, 400),  # at most GROWTH times the last one
        (0.01, 400, None, 1, None, 500),  # SECONDS
        (0.01, 400, None, 1, 1.0, 100),  # the time is over soon
        (0.01, 400, 200, 4, None, 25),  # near the end, all get some
        (0.01, 400, 40, 4, None, 10),  # the rest is small: a share for each
        (60.0, 2, 100, 2, None, 1),  # one sample takes longer than a range should
        (0.01, 400, None, 1, -3.0, 1),
    ],
)
def test_the_size_of_a_range(seconds, last, left, workers, until, size):
    assert size_of(seconds, last, left, workers, until) == size


@pytest.mark.parametrize("seconds", [1e-4, 3e-3, 0.2, 1.7, 4.9])
def test_ranges_come_to_take_between_two_and_ten_seconds(seconds):
    last, sizes = 2, []
    for _ in range(30):
        last = size_of(seconds, last, None, 3, None)
        sizes.append(last)
    assert SECONDS * 0.6 <= sizes[-1] * seconds <= MOST
    assert all(b <= GROWTH * a for a, b in zip(sizes, sizes[1:], strict=False))
