"""Threads that take pieces of work in turns: who is done with a piece takes the next one."""

import taichi as ti

from taichi_tracer.system import memory

# Iterations of a parallel loop that Taichi gives to a CPU thread at a time; ``block_dim`` does not change this number.
CPU_BLOCK = 512


@ti.data_oriented
class Turns:
    """Numbers the pieces of work of a kernel from 0 on, and gives each of them to one thread.

    A *place* is the memory of one thread. The kernel has a loop over ``iterations``: a block of ``CPU_BLOCK`` of them
    belongs to one place, and its first iteration takes one piece after the other, as long as there are some. So threads
    with light pieces take more of them::

        turns.begin()
        for iteration in range(turns.iterations):
            c, piece = turns.place_and_piece(iteration)
            while piece < turns.pieces:
                ...
                piece = turns.next_piece()

    Args:
        pieces: how many there are.
    """

    def __init__(self, pieces: int) -> None:
        self.pieces, self.places = pieces, min(pieces, ti.cfg.cpu_max_num_threads)
        self.iterations = self.places * CPU_BLOCK
        self._memory = memory.Memory()
        self.taken = ti.field(ti.i32)
        self._memory.fields.place(self.taken)
        self._memory.allocate()

    @ti.func
    def begin(self):
        """All pieces can be taken again."""
        self.taken[None] = 0

    @ti.func
    def place_and_piece(self, iteration):
        """The place of an iteration, and its first piece; ``pieces`` if it takes none."""
        piece = self.pieces
        if iteration % CPU_BLOCK == 0:
            piece = self.next_piece()
        return iteration // CPU_BLOCK, piece

    @ti.func
    def next_piece(self):
        """A piece that no thread has taken yet; at least ``pieces`` if there is none."""
        return ti.atomic_add(self.taken[None], 1)
