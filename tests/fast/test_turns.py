"""``fast.lanes``: every piece is taken once, by a thread with a place of its own."""

import numpy as np
import pytest
import taichi as ti

from taichi_tracer.fast.lanes import Turns

pytestmark = pytest.mark.usefixtures("f32")


@ti.kernel
def take_all(turns: ti.template(), times: ti.template(), inside: ti.template(), most_inside: ti.template()):
    turns.begin()
    for iteration in range(turns.iterations):
        c, piece = turns.place_and_piece(iteration)
        while piece < turns.pieces:
            ti.atomic_add(times[piece], 1)
            # A second thread in this place would find the first one inside.
            ti.atomic_max(most_inside[c], ti.atomic_add(inside[c], 1) + 1)
            ti.atomic_add(inside[c], -1)
            piece = turns.next_piece()


@pytest.mark.parametrize("pieces", [1, 3, 1000])
def test_every_piece_is_taken_once_in_each_call(pieces):
    turns = Turns(pieces)
    times = ti.field(ti.i32, pieces)
    inside, most_inside = (ti.field(ti.i32, turns.places) for _ in range(2))
    for call in range(1, 4):
        take_all(turns, times, inside, most_inside)
        assert np.all(times.to_numpy() == call)
    assert np.all(most_inside.to_numpy() <= 1)


def test_there_are_no_more_places_than_threads_or_pieces():
    assert Turns(1).places == 1
    assert Turns(10**6).places == ti.cfg.cpu_max_num_threads
