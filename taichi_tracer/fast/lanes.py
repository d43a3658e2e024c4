"""How a CPU works on many things at once: vectors of lanes, and threads that take pieces of work in turns.

Taichi has no vector instructions: it writes a vector as single numbers, and LLVM puts them together again, if each lane
does exactly the same. The small functions here are written so that LLVM recognises them.
"""

import functools
import operator

import taichi as ti

from taichi_tracer.ray import real
from taichi_tracer.system import memory
from taichi_tracer.system.seams import element, in_kernels, variable
from taichi_tracer.system.varying import varying

LANE_BITS = 4
LANES = 1 << LANE_BITS  # rays or pixels that are computed side by side: sixteen numbers of 32 bits, as in AVX-512
# Iterations of a parallel loop that Taichi gives to a CPU thread at a time; ``block_dim`` does not change this number.
CPU_BLOCK = 512

lanes = ti.types.vector(LANES, real)
flags = ti.types.vector(LANES, ti.i32)


class LaneComponents:
    """A vector whose components are vectors of lanes, or numbers that all lanes share.

    A formula of ``formulas`` takes it in place of a ``vec3``, and then computes all lanes at once.
    """

    _data_oriented = True  # allows kernels to keep it in a variable and to pass it to functions

    def __init__(self, x, y, z) -> None:
        self.x, self.y, self.z = (variable(component) for component in (x, y, z))

    def __sub__(self, other):
        return LaneComponents(self.x - other.x, self.y - other.y, self.z - other.z)

    @in_kernels
    def dot(self, other):
        """What ``tm.dot`` calls."""
        return self.x * other.x + self.y * other.y + self.z * other.z

    @in_kernels
    def cross(self, other):
        """What ``tm.cross`` calls."""
        x, y, z = other.x, other.y, other.z
        return LaneComponents(self.y * z - self.z * y, self.z * x - self.x * z, self.x * y - self.y * x)


@in_kernels
def components(x, y, z):
    """``LaneComponents`` in a kernel."""
    return LaneComponents(x, y, z)


@in_kernels
def shared(v):
    """``LaneComponents`` that all lanes share: those of a ``vec3``."""
    return LaneComponents(*(element(v, k) for k in range(3)))


@in_kernels
def larger(a, b):
    """max, written so that the compiler uses vector instructions."""
    a, b = variable(a), variable(b)
    return ti.select(a > b, a, b)


@in_kernels
def smaller(a, b):
    """min, written so that the compiler uses vector instructions."""
    a, b = variable(a), variable(b)
    return ti.select(a < b, a, b)


@in_kernels
def any_lane(condition):
    """Whether a condition holds in any lane. The compiler turns the chain of ``|`` into one test of a mask register."""
    condition = variable(condition)
    return variable(functools.reduce(operator.or_, [element(condition, k) for k in range(LANES)]))


@in_kernels
def least(values):
    """The smallest value of all lanes; each step halves their number."""
    values = variable(values)
    halves = [element(values, k) for k in range(LANES)]
    while len(halves) > 1:
        half = len(halves) // 2
        halves = [variable(smaller(halves[k], halves[k + half])) for k in range(half)]
    return halves[0]


@in_kernels
def greatest(values):
    """The largest value of all lanes."""
    return variable(-least(-values))


@in_kernels
def lanes_of(is_met):
    """A mask with bit k + 1 for each lane k in which a condition holds.

    Bit 0 stays free. Otherwise LLVM writes the first lane in another way than the others, and then uses no vector
    instructions for any of them.
    """
    lanes = range(is_met.n)
    bits = variable(ti.select(is_met, ti.Vector([2 << k for k in lanes]), ti.Vector([0 for _ in lanes])))
    return variable(functools.reduce(operator.or_, [element(bits, k) for k in lanes]))


@ti.func
def first_lane(mask):
    """The first lane of a mask of ``lanes_of``. The compiler turns this into one instruction."""
    return ti.math.popcnt(~mask & (mask - 1)) - 1


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
        self.pieces, self.places = varying(pieces), min(pieces, ti.cfg.cpu_max_num_threads)
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
