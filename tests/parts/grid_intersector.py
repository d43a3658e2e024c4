"""A uniform grid: space is cut into equal cells, and a ray tries only what lies in the cells that it passes.

J. Amanatides, A. Woo, "A fast voxel traversal algorithm for ray tracing", Eurographics 1987: it is known at which t the
next wall comes on each axis, and the ray crosses the nearest of the three.
"""

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt

CELLS = 16  # along each axis
MARGIN = 0.05  # of a cell, by which every box is widened: more than rounding moves a ray


@tt.register
class Grid(tt.RayIntersector):
    """Answers as brute force does, to the last bit: only which primitives are tried, and when, is different."""

    name = "grid"

    def bind(self, geometry, triangle_test="watertight"):
        """Write every primitive into the cells that its box touches: items[begin[c]] … items[begin[c + 1] − 1] of c."""
        super().bind(geometry, triangle_test)
        pad = 0.01 * (geometry.high - geometry.low).max() + 1e-9
        self.low, self.size = geometry.low - pad, (geometry.high - geometry.low + 2 * pad) / CELLS
        ids, boxes = geometry.hittable()
        first = np.floor((boxes[:, :3] - self.low) / self.size - MARGIN).astype(int)
        count = np.floor((boxes[:, 3:] - self.low) / self.size + MARGIN).astype(int) - first + 1
        boxes_of = zip(ids, first, count, strict=True)
        cells = sorted((np.dot(a + c, [CELLS**2, CELLS, 1]), i) for i, a, n in boxes_of for c in np.ndindex(*n))
        cells = np.array(cells, np.int32).reshape(-1, 2)
        self.begin, self.items = ti.field(ti.i32, CELLS**3 + 1), ti.field(ti.i32, max(1, len(cells)))
        self.begin.from_numpy(np.searchsorted(cells[:, 0], np.arange(CELLS**3 + 1)).astype(np.int32))
        self.items.from_numpy(np.resize(cells[:, 1], max(1, len(cells))))

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        """HitData of the nearest hit with t_min < t < t_max, of equal ones the lowest id; of any with ``any_hit``."""
        best, best_id, best_u, best_v = t_max, -1, 0.0, 0.0
        bounds = self.ray_bounds(ray)
        o, d, low, size = ray.origin, ray.direction, tm.vec3(self.low), tm.vec3(self.size)
        side_a, side_b = (low - o) / d, (low + CELLS * size - o) / d  # t at the two sides of the grid, on each axis
        t, t_out = ti.max(ti.min(side_a, side_b).max(), t_min), ti.max(side_a, side_b).min()
        inside = (o + t * d - low) / size  # where the ray enters, in cells
        cell, step = ti.cast(tm.clamp(inside, 0, CELLS - 1), ti.i32), ti.select(d > 0, 1, -1)
        # t of the next wall on each axis
        wall = ti.select(d == 0, tm.inf, t + (cell + ti.max(step, 0) - inside) * size / d)
        while self.is_legal(ray) and t <= ti.min(best, t_out) and cell.min() >= 0 and cell.max() < CELLS:
            c = (cell.x * CELLS + cell.y) * CELLS + cell.z
            for k in range(self.begin[c], self.begin[c + 1]):
                primitive_id = self.items[k]
                hit_t, u, v = self.try_primitive(ray, bounds, primitive_id, t_min)
                if t_min < hit_t and (hit_t < best or (hit_t == best and primitive_id < best_id)):
                    best, best_id, best_u, best_v = hit_t, primitive_id, u, v
            axis = ti.select(wall.x <= wall.y and wall.x <= wall.z, 0, ti.select(wall.y <= wall.z, 1, 2))
            t, cell[axis], wall[axis] = wall[axis], cell[axis] + step[axis], wall[axis] + abs(size / d)[axis]
        return self.found(ray, best, best_id, best_u, best_v, any_hit)
