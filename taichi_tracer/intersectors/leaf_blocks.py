"""The triangles of the leaves, in blocks of four: a ray asks one instruction which of the four it may hit.

In a block, the first components of four vertices are neighbours in memory, then the second ones, and so on. Therefore
a CPU computes at once on which sides of their edges a ray passes four triangles, and their distances.
Where it computes only the first, this finds candidates for the plain test: no triangle that this accepts is left out.
Thus t, u and v have the same bits as without blocks.

A leaf begins with a new block. A *place* is the number of a triangle in this order: four places are a block, and the
last places of a leaf's last block may be empty.
"""

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.triangles import edge_functions, exact_edge_functions, moller_trumbore, watertight
from taichi_tracer.geometry import Geometry
from taichi_tracer.intersectors.bvh_build import BLOCK, BLOCK_BITS
from taichi_tracer.intersectors.bvh_wide import LEAF_BITS, leaf_reference
from taichi_tracer.intersectors.lanes import components, lanes_of, larger, shared, smaller
from taichi_tracer.ray import real
from taichi_tracer.system import runtime
from taichi_tracer.system.compile_time import compile_time, element, variable
from taichi_tracer.system.memory import Memory

NO_ROW = -1  # in place of the number of a triangle


def in_blocks(references: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Move the leaves apart, so that each begins with a new block.

    Args:
        references: any array of references to nodes and leaves, see ``bvh_wide.leaf_reference``; each leaf occurs once.
        count: the number of triangles in all leaves.

    Returns:
        The same references to the moved leaves, int32, and the (count,) places of the triangles, int32.
    """
    references = references.copy()
    is_leaf = references < 0
    codes = -1 - references[is_leaf].astype(np.int64)
    first, size = codes >> LEAF_BITS, codes & ((1 << LEAF_BITS) - 1)
    blocks = -(-size // BLOCK)
    moved = np.where(size > 0, BLOCK * (np.cumsum(blocks) - blocks), 0)
    references[is_leaf] = leaf_reference(moved, moved + size)
    within = np.arange(count) - np.repeat(np.cumsum(size) - size, size)
    places = np.empty(count, np.int32)
    places[np.repeat(first, size) + within] = np.repeat(moved, size) + within
    return references, places


def leaf_triangles(geometry: Geometry) -> tuple[np.ndarray, np.ndarray]:
    """(V, 3) vertices and (n, 3) vertex ids of what ``hittable`` lists; of a sphere, two corners of its box."""
    vertices, faces = geometry.mesh.vertices, geometry.mesh.faces
    faces = faces[geometry.hittable_triangles()]
    if geometry.n_spheres > 0:
        low, high = np.split(geometry.sphere_boxes(), 2, axis=1)
        own = len(vertices) + np.arange(len(low), dtype=np.int32)
        faces = np.concatenate([faces, np.stack([own, own + len(low), own], axis=1)])
        vertices = np.concatenate([vertices, low, high])
    return vertices, faces


@ti.func
def leaf_range(reference):
    """The first triangle and the number of triangles of a leaf, see ``leaf_reference``."""
    return (-1 - reference) >> LEAF_BITS, (-1 - reference) & ((1 << LEAF_BITS) - 1)


@ti.dataclass
class Aim:
    """A ray prepared for the projection of ``triangles.watertight``.

    x, y, z: the two smaller axes of the direction, and its largest axis. origin: the components of the origin along
    these axes. shear_x, shear_y: how far the ray goes along the smaller axes for each unit along the largest.
    """

    x: ti.i32
    y: ti.i32
    z: ti.i32
    origin: tm.vec3
    shear_x: real
    shear_y: real


@ti.func
def aim_of(ray):
    """The ``Aim`` of a ray."""
    d = ray.direction
    size = abs(d)
    largest = ti.select(size.x > size.y and size.x > size.z, 0, ti.select(size.y > size.z, 1, 2))
    x, y, z = ti.select(largest == 2, 0, largest + 1), ti.select(largest == 0, 2, largest - 1), largest
    o, own = in_own_axes(largest, ray.origin), in_own_axes(largest, d)
    return Aim(x=x, y=y, z=z, origin=o, shear_x=own.x / own.z, shear_y=own.y / own.z)


@ti.func
def in_own_axes(largest, v):
    """The components along the two smaller axes of a direction, and along its largest one, as in ``aim_of``."""
    return ti.select(largest == 0, v.yzx, ti.select(largest == 1, v.zxy, v))


@ti.data_oriented
class LeafBlocks:
    """The vertices and the numbers of the primitives, by place.

    Args:
        fields: has the memory.
        places: how many places there are.
        solve: the triangle test. If it has no form for blocks, all triangles of a block are tried.
        is_mixed: whether there are spheres among the triangles; then all primitives of a block are tried, too.
    """

    def __init__(self, fields: ti.FieldsBuilder, places: int, solve, is_mixed: bool) -> None:
        self.test = BLOCK_TESTS[solve] if primitives_at_once(solve, is_mixed) == BLOCK else None
        self.vertices = ti.Vector.field(3 * BLOCK, float)  # of block, axis: the lanes of one corner after the other
        self.ids = ti.field(ti.i32)  # of block, lane
        block = fields.dense(ti.i, max(1, places // BLOCK))  # nested, so that the memory of a block is contiguous
        block.dense(ti.j, 3).place(self.vertices)
        block.dense(ti.j, BLOCK).place(self.ids)

    def load(self, memory: Memory, rows: np.ndarray, vertices: np.ndarray, faces: np.ndarray, ids: np.ndarray) -> None:
        """Write the blocks: ``rows`` has one row of ``faces`` and ``ids`` for each place, or ``NO_ROW``.

        The vertices of an empty place are NaN, with which no condition holds.
        """
        corners = vertices[faces[rows]]  # of place, corner, axis
        corners[rows == NO_ROW] = np.nan
        memory.write(self.vertices, corners.reshape(-1, BLOCK, 3, 3).transpose(0, 3, 2, 1).reshape(-1, 3, 3 * BLOCK))
        memory.write(self.ids, ids[rows].reshape(-1, BLOCK))

    @compile_time
    def primitive(self, place):
        """The number of the primitive at a place."""
        return variable(element(self.ids, place >> BLOCK_BITS, place & (BLOCK - 1)))

    @compile_time
    def component(self, place, corner, axis):
        """A component of a vertex."""
        lanes = element(self.vertices, place >> BLOCK_BITS, axis)
        return element(lanes, BLOCK * corner + (place & (BLOCK - 1)))

    @compile_time
    def triangle(self, place):
        """The three vertices at a place."""
        place = variable(place)
        corners = ([self.component(place, corner, axis) for axis in range(3)] for corner in range(3))
        return tuple(variable(tm.vec3(*corner)) for corner in corners)

    @compile_time
    def along(self, block, axis):
        """The components of all vertices of a block along an axis."""
        return variable(element(self.vertices, block, axis))

    @ti.func
    def candidates(self, ray, aim, block, used):
        """A mask, see ``lanes_of``, of the primitives of a block that the ray may hit. ``used`` places are not empty.

        At an empty place, the vertices are NaN, and no condition holds.
        """
        if ti.static(self.test):
            return lanes_of(self.test(self, ray, aim, block))
        return (2 << used) - 2

    @compile_time
    def edges(self, aim, block):
        """The edge functions of ``watertight`` for each triangle of a block."""
        x, y = projected(aim, *(self.along(block, axis) for axis in (aim.x, aim.y, aim.z)))
        return edge_functions(*(corner_of(numbers, corner) for corner in range(3) for numbers in (x, y)))

    @compile_time
    def exact_edges(self, aim, place):
        """The edge functions of one triangle with the right signs, as ``watertight`` computes them if one is 0."""
        numbers = []
        for corner in range(3):
            numbers += projected(aim, *(self.component(place, corner, axis) for axis in (aim.x, aim.y, aim.z)))
        return exact_edge_functions(*numbers) if runtime.can_widen() else edge_functions(*numbers)

    @compile_time
    def distances(self, ray, bounds, aim, block):
        """t of ``watertight`` ``within_box`` for each triangle of a block; −∞ where the ray misses box or plane."""
        axes = [self.along(block, axis) for axis in range(3)]
        n = stable_normals(*axes)
        det = variable(-tm.dot(shared(ray.direction), n))
        t = variable(-tm.dot(corners(*axes, 0) - shared(ray.origin), n) / det)
        t_near, t_far = (ti.Vector([sign * tm.inf for _ in range(BLOCK)]) for sign in (-1, 1))
        for k in range(3):
            a, b, c = (corner_of(axes[k], corner) for corner in range(3))
            low, high = variable(smaller(a, smaller(b, c))), variable(larger(a, larger(b, c)))
            inverse, near, far = (element(v, k) for v in (bounds.inverse, bounds.near_origin, bounds.far_origin))
            is_forward = variable(inverse >= 0)
            t_near = larger((ti.select(is_forward, low, high) - near) * inverse, t_near)
            t_far = smaller((ti.select(is_forward, high, low) - far) * inverse, t_far)
        t_near, t_far = variable(t_near), variable(t_far)
        t = ti.select(t < t_near, t_near, ti.select(t > t_far, t_far, t))
        return variable(ti.select((t_near <= t_far) & (det != 0), t, -tm.inf))


@compile_time
def projected(aim, *numbers):
    """Components of vertices along the axes of an ``Aim``, as the ray sees them: sheared along its largest axis."""
    x, y, along = (number - element(aim.origin, k) for k, number in enumerate(numbers))
    along = variable(along)
    return variable(x - aim.shear_x * along), variable(y - aim.shear_y * along)


@ti.func
def is_inside(u, v, w):
    """Whether a ray with these exact edge functions passes inside the edges (``triangles.watertight``)."""
    return u + v + w != 0 and not ((u < 0 or v < 0 or w < 0) and (u > 0 or v > 0 or w > 0))


@compile_time
def corner_of(numbers, corner):
    """The numbers of one corner, out of those of all vertices of a block."""
    return variable(ti.Vector([element(numbers, BLOCK * corner + lane) for lane in range(BLOCK)]))


@compile_time
def stable_normals(x, y, z):
    """``triangles.stable_normal`` of each triangle of a block, from the components of all vertices."""
    ex, ey, ez = (variable(next_corner(numbers) - numbers) for numbers in (x, y, z))
    squared = variable(ex * ex + ey * ey + ez * ez)
    l0, l1, l2 = (corner_of(squared, k) for k in range(3))
    is_0_longest, is_1_longest = variable((l0 >= l1) & (l0 >= l2)), variable(l1 >= l2)
    p, q = zip(*(two_shortest(is_0_longest, is_1_longest, e) for e in (ex, ey, ez)), strict=True)
    return tm.cross(components(*p), components(*q))


@compile_time
def corners(x, y, z, corner):
    """One vertex of each triangle of a block, from the components of all vertices."""
    return components(*(corner_of(numbers, corner) for numbers in (x, y, z)))


@compile_time
def next_corner(numbers):
    """b, c, a of the numbers a, b, c of each triangle."""
    count = 3 * BLOCK
    return variable(ti.Vector([element(numbers, (BLOCK + i) % count) for i in range(count)]))


@compile_time
def two_shortest(is_0_longest, is_1_longest, e):
    """A component of the two shortest of the three edges of each triangle, in the order of ``stable_normal``."""
    e0, e1, e2 = (corner_of(e, k) for k in range(3))
    p = ti.select(is_0_longest, e1, ti.select(is_1_longest, e2, e0))
    q = ti.select(is_0_longest, e2, ti.select(is_1_longest, e0, e1))
    return variable(p), variable(q)


@ti.func
def may_be_inside(u, v, w):
    """Whether edge functions are on the same side, or 0. If one is 0, ``exact_edges`` decides."""
    return (smaller(u, smaller(v, w)) >= 0) | (larger(u, larger(v, w)) <= 0)


@ti.func
def may_pass_inside(blocks: ti.template(), ray, aim, block):
    """Whether the ray passes on the same side of all three edges, or exactly through one (``triangles.watertight``)."""
    return may_be_inside(*blocks.edges(aim, block))


@ti.func
def may_solve(blocks: ti.template(), ray, aim, block):
    """Whether ``moller_trumbore`` finds that the ray passes inside the edges."""
    x, y, z = blocks.along(block, 0), blocks.along(block, 1), blocks.along(block, 2)
    v0, v1, v2 = corners(x, y, z, 0), corners(x, y, z, 1), corners(x, y, z, 2)
    is_inside, _t, _u, _v, _det = moller_trumbore(shared(ray.origin), shared(ray.direction), v0, v1, v2)
    return is_inside


BLOCK_TESTS = {watertight: may_pass_inside, moller_trumbore: may_solve}


def primitives_at_once(solve, is_mixed: bool) -> int:
    """How many primitives a ray tests together; the arguments are those of ``LeafBlocks``.

    Only on a CPU several: a GPU has no vector instructions, and may round the two forms of a test differently.
    """
    return BLOCK if solve in BLOCK_TESTS and not is_mixed and runtime.can("separate roundings") else 1
