"""Lamps by a hierarchy: near, bright lamps that face the point get the samples, out of thousands.

Conty Estévez & Kulla, "Importance sampling of many lights with adaptive tree splitting", HPG 2018; the importance is
that of PBR, 4th edition, section 12.6.3, without the tree splitting. The tree is balanced: node i has the children 2i
and 2i + 1, the root is 1, and the leaves are lamps. Each node bounds its lamps by a box, by a cone around their normals
and by the sum of their power. A sample goes down from the root and chooses a child in proportion to its importance for
the point that is lit, so that it takes log₂ L steps for L lamps.
"""

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.lights.choice import LampChoice, LampTable
from taichi_tracer.system import runtime
from taichi_tracer.system.memory import filled
from taichi_tracer.system.parts import overridable, register

# A node of the tree: the corners of its box, the axis of its cone, the cone's half angle, and the sum of area ×
# luminance, which is 0 for a leaf without a lamp. The row of node i is i, and row 0 is not used.
NODE = np.dtype([("low", float, 3), ("high", float, 3), ("axis", float, 3), ("angle", float), ("power", float)])
NO_CONE = -10.0  # the angle of a leaf without a lamp: so far below 0 that every cone contains it


@register
@ti.data_oriented
@overridable()
class ByHierarchy(LampChoice):
    """In proportion to a bound of what the lamps can contribute to the point."""

    name = "hierarchy"

    def prepare(self, lamps: LampTable) -> None:
        """Build the tree."""
        order, nodes = build(lamps)
        self.leaves = len(order)
        leaf_of = np.argsort(order)[self.leaves - len(lamps) :]  # those without a lamp, −1, come first
        bounds = nodes["low"], nodes["high"], nodes["axis"], np.cos(nodes["angle"]), nodes["power"]
        self._memory, fields = filled(order, leaf_of, *bounds)
        self.lamps, self.leaf_of, self.low, self.high, self.axis, self.cosine, self.power = fields

    @ti.func
    def choose(self, x, n, xi):
        """(lamp, probability, rest): the way down from the root; ξ is stretched again at each step.

        A quotient that rounds to 1 is made smaller: at a node with share 1, it would lead to a lamp of probability 0.
        """
        node, probability = 1, 1.0
        while node < self.leaves:
            left = self.share_of_left(x, n, node)
            if xi < left:
                node, probability = 2 * node, probability * left
                xi /= left
            else:
                node, probability = 2 * node + 1, probability * (1 - left)
                xi = (xi - left) / (1 - left)
            xi = ti.min(xi, 1 - ti.static(runtime.epsilon()))
        lamp = self.lamps[node - self.leaves]
        return ti.max(lamp, 0), probability, xi

    @ti.func
    def probability(self, x, n, lamp):
        """The product of the same shares, on the way up from the leaf."""
        node, probability = self.leaf_of[lamp] + self.leaves, 1.0
        while node > 1:
            left = self.share_of_left(x, n, node >> 1)
            probability *= ti.select(node & 1 == 0, left, 1 - left)
            node >>= 1
        return probability

    @ti.func
    def share_of_left(self, x, n, node):
        """The probability of the left child. If no child can contribute, it is that of the powers.

        On a GPU, the quotient of a number and itself may be larger than 1.
        """
        left, right = self.importance(x, n, 2 * node), self.importance(x, n, 2 * node + 1)
        if left + right == 0:
            left, right = self.power[2 * node], self.power[2 * node + 1]
        return ti.select(left + right > 0, ti.min(1.0, left / (left + right)), 1.0)

    @ti.func
    def importance(self, x, n, node):
        """A bound of what the lamps of a node contribute to the point x with the normal n, up to a factor.

        θ_w is the angle between the cone's axis and the direction from the box to x, θ_o the half angle of the cone,
        and θ_b the angle in which x sees the box. The smallest angle between a lamp's normal and the direction to x is
        θ_w − θ_o − θ_b.
        """
        found = 0.0
        if self.power[node] > 0:
            centre, half = (self.low[node] + self.high[node]) / 2, (self.high[node] - self.low[node]) / 2
            radius, to_x = tm.length(half), x - centre
            distance = tm.length(to_x)
            cosine_b = -1.0
            if distance > radius:
                sine_b = radius / distance
                cosine_b = ti.sqrt(ti.max(0.0, 1 - sine_b * sine_b))
            w = to_x / ti.max(distance, ti.static(runtime.smallest()))
            cosine = cosine_of_difference(tm.dot(self.axis[node], w), self.cosine[node])
            cosine = cosine_of_difference(cosine, cosine_b)
            receiver = cosine_of_difference(-tm.dot(n, w), cosine_b)
            if cosine > 0 and receiver > 0:
                near = ti.max(distance, radius)  # inside the box, the distance to a lamp is unknown
                found = self.power[node] * cosine * receiver / (near * near)
        return found


@ti.func
def cosine_of_difference(cosine_a, cosine_b):
    """cos(max(0, a − b)) of two angles in [0, π], from their cosines."""
    sine_a, sine_b = ti.sqrt(ti.max(0.0, 1 - cosine_a * cosine_a)), ti.sqrt(ti.max(0.0, 1 - cosine_b * cosine_b))
    return ti.select(cosine_a > cosine_b, 1.0, cosine_a * cosine_b + sine_a * sine_b)


def build(lamps: LampTable) -> tuple[np.ndarray, np.ndarray]:
    """((n,) int32 lamps of the leaves, −1 for none; (2n,) ``NODE``) of the tree of a table of lamps.

    A node is split in the middle of its lamps, along the longest side of its box.
    """
    count = len(lamps)
    leaves = 1 << max(0, int(count - 1).bit_length())
    order = kd_order((lamps.low + lamps.high) / 2, leaves)
    place = np.flatnonzero(order >= 0)
    nodes = np.full(2 * leaves, np.array((np.inf, -np.inf, (0, 0, 1), NO_CONE, 0), NODE))
    leaf, of = leaves + place, order[place]
    nodes["low"][leaf], nodes["high"][leaf] = lamps.low[of], lamps.high[of]
    has_side = np.asarray(lamps.normals[of].any(axis=1) & (not lamps.two_sided))
    nodes["axis"][leaf] = np.where(has_side[:, None], lamps.normals[of], [0.0, 0.0, 1.0])
    nodes["angle"][leaf] = np.where(has_side, 0, np.pi)
    power = lamps.areas * lamps.radiance
    nodes["power"][leaf] = (power / power.max())[of]
    first = leaves // 2
    while first >= 1:  # the parents of one level, and their children
        parent, a, b = nodes[first : 2 * first], nodes[2 * first : 4 * first : 2], nodes[2 * first + 1 : 4 * first : 2]
        parent["low"], parent["high"] = np.minimum(a["low"], b["low"]), np.maximum(a["high"], b["high"])
        parent["power"] = a["power"] + b["power"]
        parent["axis"], parent["angle"] = joined_cones(a["axis"], a["angle"], b["axis"], b["angle"])
        first //= 2
    return order, nodes


def kd_order(points: np.ndarray, leaves: int) -> np.ndarray:
    """(leaves,) int32: the point of each leaf, −1 for none; the halves of each node lie on two sides of a plane."""
    ids, node = np.arange(len(points)), np.zeros(len(points), np.int64)  # the points by their nodes of one level
    for _ in range(leaves.bit_length() - 1):
        _, first, number, count = np.unique(node, return_index=True, return_inverse=True, return_counts=True)
        at = points[ids]
        extent = np.maximum.reduceat(at, first) - np.minimum.reduceat(at, first)
        along = at[np.arange(len(at)), extent.argmax(axis=1)[number]]
        ids = ids[np.lexsort((along, node))]
        is_right = np.arange(len(ids)) - first[number] >= (count[number] + 1) // 2
        node = 2 * node + is_right
    found = np.full(leaves, -1, np.int32)
    found[node] = ids
    return found


def joined_cones(axis_a, theta_a, axis_b, theta_b) -> tuple[np.ndarray, np.ndarray]:
    """(axes, half angles) of the smallest cones around pairs of cones (PBR, 4th edition, section 3.8.4)."""
    between = np.arccos(np.clip((axis_a * axis_b).sum(axis=1), -1, 1))
    theta = (theta_a + theta_b + between) / 2
    pivot = np.cross(axis_a, axis_b)
    length = np.linalg.norm(pivot, axis=1)
    turn = theta - theta_a
    pivot = pivot / np.where(length > 0, length, 1)[:, None]
    turned = axis_a * np.cos(turn)[:, None] + np.cross(pivot, axis_a) * np.sin(turn)[:, None]  # pivot ⊥ axis_a
    b_contains_a = np.minimum(between + theta_a, np.pi) <= theta_b
    a_contains_b = np.minimum(between + theta_b, np.pi) <= theta_a
    cases = b_contains_a, a_contains_b, (theta >= np.pi) | (length == 0)  # the last: all directions
    axis = np.select([case[:, None] for case in cases], [axis_b, axis_a, axis_a], turned)
    return axis, np.select(cases, [theta_b, theta_a, np.pi], theta)
