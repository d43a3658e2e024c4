"""Look-ups of an environment that are made together: sixteen directions at once become texels, with the same bits.

The longest part of a look-up are the two angles of its direction, chains of operations of which each waits for the one
before it. Sixteen directions need the same time as one.
"""

import taichi as ti

from taichi_tracer.fast.lanes import LANES
from taichi_tracer.system import memory
from taichi_tracer.system.seams import replaced


def can_wait_for(light) -> bool:
    """Whether the look-ups of a light may be made together: the nearest texel of an image, by the package's methods."""
    if light.name != "environment" or light.effects.environment != "image":
        return False
    return light.environment.lookup == "nearest" and not replaced(light.environment)


@ti.data_oriented
class LookUps:
    """Memory for directions, and their look-ups. A place holds the directions of one thread.

    Fields of sixteen directions in a place: ``x``, ``y`` and ``z``, their components; ``u`` and ``v``, their
    ``Environment.coords``.

    Args:
        light: an ``EnvironmentLight``.
        places: the number of lists that can be looked up at the same time.
        most: the largest number of directions of a place.
    """

    def __init__(self, light, places: int, most: int) -> None:
        self.light, self.environment = light, light.environment
        self._memory = memory.Memory()
        self.x, self.y, self.z, self.u, self.v = (ti.Vector.field(LANES, float) for _ in range(5))
        self.group_u, self.group_v = (ti.Vector.field(LANES, float) for _ in range(2))
        self.count = ti.field(ti.i32)
        place = self._memory.fields.dense(ti.i, places)
        place.place(self.count, self.group_u, self.group_v)
        for field in (self.x, self.y, self.z, self.u, self.v):
            place.dense(ti.j, -(-most // LANES)).place(field)
        self._memory.allocate()

    @ti.func
    def clear(self, c):
        """Forget the directions of a place."""
        self.count[c] = 0

    @ti.func
    def add(self, c, direction):
        """Add a unit direction to a place. Returns its number; the first one is 0."""
        k = self.count[c]
        d = self.light.with_y_up(direction)
        self.x[c, k // LANES][k % LANES], self.y[c, k // LANES][k % LANES] = d.x, d.y
        self.z[c, k // LANES][k % LANES] = d.z
        self.count[c] = k + 1
        return k

    @ti.func
    def find(self, c):
        """Compute u and v of all directions of a place."""
        for i in range((self.count[c] + LANES - 1) // LANES):
            self.u[c, i] = self.environment.longitude(self.z[c, i], self.x[c, i])
            self.v[c, i] = self.environment.elevation(self.y[c, i])

    @ti.func
    def find_group(self, c, dx, dy, dz):
        """Compute u and v of sixteen unit directions at once."""
        self.group_u[c] = self.environment.longitude(dz, dx)
        self.group_v[c] = self.environment.elevation(dy)

    @ti.func
    def coords_of_group(self, c, lane):
        """``Environment.coords`` of a direction of ``find_group``."""
        return self.group_u[c][lane], self.group_v[c][lane]

    @ti.func
    def coords(self, c, k):
        """``Environment.coords`` of a direction."""
        return self.u[c, k // LANES][k % LANES], self.v[c, k // LANES][k % LANES]

    @ti.func
    def radiance(self, c, k):
        """``Environment.radiance`` of a direction."""
        u, v = self.coords(c, k)
        return self.environment.radiance_at(u, v)
