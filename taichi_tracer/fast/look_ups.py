"""An environment for sixteen pixels at once, with the same bits: looked up in directions, and directions drawn to it.

The two angles of a direction take the longest time of a look-up: they are chains of operations, each of which waits for
the one before it. In a loop that only reads and writes variables of the kernel, LLVM computes several directions with
each instruction. To find the texel of a random number takes two reads of tables, one after the other, in slow memory. A
loop that only searches has the reads of many pixels on their way at once.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import LANES, flags, lanes
from taichi_tracer.system import memory
from taichi_tracer.system.seams import replaced


def can_wait_for(light) -> bool:
    """Whether the look-ups of a light may be made together: the nearest texel of an image, by the package's methods."""
    if light.name != "environment" or light.effects.environment != "image":
        return False
    return light.environment.lookup == "nearest" and not replaced(light.environment) and not replaced(light)


@ti.data_oriented
class LookUps:
    """Memory for directions, and their look-ups. A place holds the directions of one thread.

    Fields of sixteen directions in a place: ``x``, ``y`` and ``z``, their components; ``u`` and ``v``, their
    ``Environment.coords``; ``row`` and ``column``, their texel. Directions that are added one by one come first, and
    whole groups of sixteen come behind. ``light_of`` is the radiance of each direction that was added alone, and
    ``pdf_of``, if it is wanted, ``EnvironmentLight.pdf`` of it.

    Args:
        light: an ``EnvironmentLight``.
        places: the number of lists that can be looked up at the same time.
        most: the largest number of single directions of a place. most_groups: the same for groups.
        finds_pdf: whether ``pdf_of`` is wanted.
    """

    def __init__(self, light, places: int, most: int, most_groups: int, finds_pdf: bool = False) -> None:
        self.light, self.environment, self.finds_pdf = light, light.environment, finds_pdf
        self.first_group = -(-most // LANES)
        self._memory = memory.Memory(scratch="LookUps")
        self.x, self.y, self.z, self.u, self.v = (ti.Vector.field(LANES, float) for _ in range(5))
        self.count, self.groups = ti.field(ti.i32), ti.field(ti.i32)
        place = self._memory.fields.dense(ti.i, places)  # only of vectors, see ``packets.Packets``
        self.row, self.column = (ti.Vector.field(LANES, ti.i32) for _ in range(2))
        for field in (self.x, self.y, self.z, self.u, self.v, self.row, self.column):
            place.dense(ti.j, self.first_group + most_groups).place(field)
        self.light_of, self.pdf_of = ti.Vector.field(3, float), ti.field(float)
        place = self._memory.fields.dense(ti.i, places)
        place.place(self.count, self.groups)
        place.dense(ti.j, most).place(self.light_of)
        place.dense(ti.j, most if finds_pdf else 1).place(self.pdf_of)
        self._memory.allocate()

    @ti.func
    def clear(self, c):
        """Forget the directions of a place."""
        self.count[c], self.groups[c] = 0, 0

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
    def add_group(self, c, dx, dy, dz):
        """Add sixteen unit directions at once."""
        g = self.groups[c]
        row = self.first_group + g
        self.x[c, row], self.y[c, row], self.z[c, row] = dx, dy, dz
        if ti.static(self.light.up_axis == "z"):
            self.y[c, row], self.z[c, row] = dz, -dy
        self.groups[c] = g + 1

    @ti.func
    def number_in_group(self, g, lane):
        """The number of a direction of ``add_group``; g says which group of the place, counted from 0."""
        return (self.first_group + g) * LANES + lane

    @ti.func
    def find(self, c):
        """Compute u and v of all directions of a place, and look up those that were added alone."""
        rows = (self.count[c] + LANES - 1) // LANES
        for i in range(rows + self.groups[c]):
            place = ti.select(i < rows, i, i - rows + self.first_group)
            x, y, z = self.x[c, place], self.y[c, place], self.z[c, place]
            u, v, row, column = lanes(0.0), lanes(0.0), flags(0), flags(0)
            for lane in range(LANES):
                u[lane], v[lane] = self.environment.coords(tm.vec3(x[lane], y[lane], z[lane]))
                row[lane], column[lane] = self.environment.texel_of(u[lane], v[lane])
            self.u[c, place], self.v[c, place], self.row[c, place], self.column[c, place] = u, v, row, column
        # Their texels lie far apart, in slow memory. This loop does nothing else: so, many are on their way at once.
        for k in range(self.count[c]):
            self.light_of[c, k] = self.look_up(c, k)
            if ti.static(self.finds_pdf):
                i, lane = k // LANES, k % LANES
                self.pdf_of[c, k] = self.light.pdf_of(self.row[c, i][lane], self.column[c, i][lane])

    @ti.func
    def look_up(self, c, k):
        """``Environment.radiance`` of a direction, by its number."""
        i, lane = k // LANES, k % LANES
        return self.environment.radiance_of(self.row[c, i][lane], self.column[c, i][lane])

    @ti.func
    def coords(self, c, k):
        """``Environment.coords`` of a direction, by its number."""
        return self.u[c, k // LANES][k % LANES], self.v[c, k // LANES][k % LANES]


@ti.data_oriented
class LightLanes:
    """What ``EnvironmentLight.sample_direction`` draws for each pixel of a group, in each place.

    Fields of a place, sixteen lanes each: ``x``, ``y`` and ``z``, the components of a direction; ``pdf``, its density.

    Args:
        light: an ``EnvironmentLight``. places: the number of threads.
    """

    def __init__(self, light, places: int) -> None:
        self.light = light
        self._memory = memory.Memory(scratch="LightLanes")
        self.x, self.y, self.z, self.pdf = (ti.Vector.field(LANES, float) for _ in range(4))
        self._memory.fields.dense(ti.i, places).place(self.x, self.y, self.z, self.pdf)
        self._memory.allocate()

    @ti.func
    def find(self, c, first, second):
        """Draw a direction for each pixel of a group.

        Args:
            first, second: the pairs of random numbers of the pixels, in lanes.
        """
        u, height, pdf = lanes(0.0), lanes(0.0), lanes(0.0)
        for lane in range(LANES):
            row, column, u[lane], height[lane] = self.light.find_texel(tm.vec2(first[lane], second[lane]))
            pdf[lane] = self.light.pdf_of(row, column)
        x, y, z = lanes(0.0), lanes(0.0), lanes(0.0)
        for lane in range(LANES):
            w_i = self.light.direction_at(u[lane], height[lane])
            x[lane], y[lane], z[lane] = w_i.x, w_i.y, w_i.z
        self.x[c], self.y[c], self.z[c], self.pdf[c] = x, y, z, pdf

    @ti.func
    def sample(self, c, lane):
        """(direction, pdf) of one pixel."""
        return tm.vec3(self.x[c][lane], self.y[c][lane], self.z[c][lane]), self.pdf[c][lane]
