"""Statistics of the contracts: tails of distributions, many tests at once, and χ² tests over cells of the sphere.

The tails are approximations: to a tenth where p is 0.001, and to a factor of 2 where it is 10⁻⁶. scipy has them
exactly, but a part should be checked where it is not installed. What is right has a p far above the levels of the
contracts, and what is wrong has one far below.
"""

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

# The probability that a part which is right fails one of all the tests of its contract. The seeds are fixed, so that a
# part which passes once passes always.
ALPHA = 0.01
LAST = 1 - 2.0**-24  # the largest random number of f32
CORNERS = np.array([[0, 0], [0, LAST], [LAST, 0], [LAST, LAST]])  # of pairs of random numbers
ABOVE_ZERO = np.finfo(np.float64).tiny  # the least value of what must not be 0
QUARTERS = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])  # corners of the quarters of a rectangle, in their size
PDF_TOLERANCE = 1e-2  # of ∫ pdf dω, where the cells are not fine enough for a kink or a pole of the density
CELL_TOLERANCE, MOST_HALVINGS = 3e-6, 9  # of the integral over a rectangle; how often the sides of a cell are halved
LEAST_EXPECTED = 5  # in a cell of a χ² test; cells with less are put together
_erfc = np.vectorize(math.erfc, otypes=[np.float64])


def chi_square_sf(x, k: int):
    """The probability that a χ² of k degrees of freedom is larger than x (Wilson & Hilferty, PNAS 1931)."""
    spread = 2 / (9 * k)
    z = (np.cbrt(np.asarray(x, np.float64) / k) - (1 - spread)) / math.sqrt(spread)
    return _erfc(z / math.sqrt(2)) / 2


def sidak(count, alpha=ALPHA):
    """The level of each of ``count`` independent tests that gives all of them together the level ``alpha``."""
    return -np.expm1(np.log1p(-alpha) / count)


def largest_z(count, alpha=ALPHA):
    """The |z| that none of ``count`` independent normal numbers exceeds, but with the probability ``alpha``."""
    return -NormalDist().inv_cdf(sidak(count, alpha) / 2)


def chi_square_p(observed, expected):
    """p of counts against expected counts, both of any shape; cells in which little is expected are put together."""
    order = np.argsort(expected, axis=None)
    observed, expected = observed.ravel()[order], expected.ravel()[order]
    pooled = max(1, int(np.searchsorted(np.cumsum(expected), LEAST_EXPECTED)) + 1)
    observed = np.concatenate([[observed[:pooled].sum()], observed[pooled:]])
    expected = np.concatenate([[expected[:pooled].sum()], expected[pooled:]])
    if len(expected) < 2:
        return 1.0
    return chi_square_sf((np.square(observed - expected) / expected).sum(), len(expected) - 1)


@dataclass(frozen=True)
class SphereCells:
    """Cells of the sphere about an axis: rings between values of s = (1 − cos θ)/2, each cut into equal angles φ.

    s is |ω − axis|²/4, so that it keeps its digits close to the axis, where narrow lobes are.

    Attributes:
        axis: (3,) unit vector. edges: (rings + 1,) of s, ascending from 0 to 1. columns: how many cells a ring has.
        nodes: of Gauss's rule, along each side of a cell; with one, functions are constant in each cell.
    """

    axis: np.ndarray
    edges: np.ndarray
    columns: int = 16
    nodes: int = 5

    @classmethod
    def equal_angles(cls, rows, columns):
        """Cells about +y: the texels of an equirectangular image, in which a function is constant."""
        return cls(np.array([0.0, 1.0, 0.0]), (1 - np.cos(np.pi * np.arange(rows + 1) / rows)) / 2, columns, 1)

    @classmethod
    def of_samples(cls, directions, rings=12):
        """Rings that hold equally many of the directions, about their mean, and wider and wider ones beyond them."""
        axis = directions.mean(axis=0)
        axis /= np.linalg.norm(axis)
        s = np.square(directions - axis).sum(axis=1) / 4
        edges = np.quantile(s, np.arange(1, rings + 1) / rings)
        doublings = int(np.ceil(np.log2(1 / max(edges[-1], 1e-30))))
        beyond = np.minimum(edges[-1] * 2.0 ** np.arange(1, doublings + 1), 1)
        return cls(axis, np.unique(np.concatenate([[0], np.minimum(edges, 1), beyond, [1]])))

    def frame(self):
        """Two unit vectors at right angles to the axis; about +y they are x and z."""
        x = np.array([1.0, 0, 0]) if abs(self.axis[0]) < 0.9 else np.array([0, 0, 1.0])
        x = x - self.axis * (x @ self.axis)
        x /= np.linalg.norm(x)
        return x, np.cross(x, self.axis)

    def counts(self, directions):
        """(rings, columns) how many of the (N, 3) directions lie in each cell."""
        x, y = self.frame()
        s = np.clip(np.square(directions - self.axis).sum(axis=1) / 4, 0, 1)
        phi = np.arctan2(directions @ y, directions @ x) / (2 * np.pi) % 1.0
        ring = np.clip(np.searchsorted(self.edges, s, side="right") - 1, 0, len(self.edges) - 2)
        column = np.minimum((phi * self.columns).astype(int), self.columns - 1)
        cells = np.bincount(ring * self.columns + column, minlength=(len(self.edges) - 1) * self.columns)
        return cells.reshape(-1, self.columns)

    def integrals(self, function, least_halvings=1):
        """(rings, columns, k) ∫ f dω over each cell, by Gauss's rule in s and φ.

        Args:
            function: (N, 3) unit directions → (N,) or (N, k); k is 1 for (N,).
            least_halvings: how often each cell is cut at least: both integrals may miss the same narrow lobe.
        """
        rings, step = len(self.edges) - 1, 2 * np.pi / self.columns
        ring, column = np.mgrid[0:rings, 0 : self.columns].reshape(2, -1)
        corners = np.stack([self.edges[ring], step * column], axis=1)
        sizes = np.stack([np.diff(self.edges)[ring], np.full(len(ring), step)], axis=1)
        found = self._of_rectangles(function, corners, sizes)
        if self.nodes > 1:
            found = self._refined(function, corners, sizes, found, least_halvings)
        return found.reshape(rings, self.columns, -1)

    def _refined(self, function, corners, sizes, coarse, least_halvings, halvings=1):
        """(N, k) ∫ f dω over rectangles, each cut in four until that changes its integral by less than a tolerance.

        Args:
            coarse: (N, k) the integrals over the whole rectangles. halvings: how often they are cut with this one.
        """
        quarter_sizes = np.repeat(sizes, 4, axis=0) / 2
        quarters = np.repeat(corners, 4, axis=0) + np.tile(QUARTERS, (len(corners), 1)) * quarter_sizes
        fine = self._of_rectangles(function, quarters, quarter_sizes)
        total = fine.reshape(-1, 4, fine.shape[1]).sum(axis=1)
        is_open = (np.abs(total - coarse) > CELL_TOLERANCE).any(axis=1) | (halvings <= least_halvings)
        if is_open.any() and halvings < MOST_HALVINGS:
            four = np.repeat(is_open, 4)
            finer = self._refined(
                function, quarters[four], quarter_sizes[four], fine[four], least_halvings, halvings + 1
            )
            total[is_open] = finer.reshape(-1, 4, fine.shape[1]).sum(axis=1)
        return total

    def _of_rectangles(self, function, corners, sizes):
        """(N, k) ∫ f dω over (N, 2) rectangles of s and φ."""
        nodes, weights = np.polynomial.legendre.leggauss(self.nodes)
        nodes, weights = (nodes + 1) / 2, weights / 2
        s = (corners[:, 0, None] + sizes[:, 0, None] * nodes)[:, :, None]
        phi = (corners[:, 1, None] + sizes[:, 1, None] * nodes)[:, None, :]
        cosine, sine = 1 - 2 * s, 2 * np.sqrt(s * (1 - s))
        x, y = self.frame()
        directions = (
            cosine[..., None] * self.axis + (sine * np.cos(phi))[..., None] * x + (sine * np.sin(phi))[..., None] * y
        )
        values = np.asarray(function(directions.reshape(-1, 3)), np.float64)
        values = values.reshape(len(corners), self.nodes, self.nodes, -1)
        return np.einsum("i,j,nijk->nk", weights, weights, values) * (2 * sizes.prod(axis=1))[:, None]  # dω = 2 ds dφ


def check_range(what, values, low=-np.inf, high=np.inf):
    """Raise an AssertionError if a number is not finite, or below ``low``, or above ``high``."""
    values = np.asarray(values, np.float64)
    assert np.isfinite(values).all(), f"{what} is not finite"
    assert (values >= low).all(), f"{what} is {values.min()}, below {low:g}"
    assert (values <= high).all(), f"{what} is {values.max()}, above {high:g}"


def check_near(what, values, expected, tolerance):
    """Raise an AssertionError if a number differs from the expected one by more than the tolerance, or is NaN."""
    off = np.abs(np.subtract(values, expected)).max()
    assert off <= tolerance, f"{what}: off by {off:.2g}"


def check_unit(what, directions, tolerance=1e-5):
    """Raise an AssertionError if one of the (N, 3) directions has not the length 1."""
    check_near(f"{what}: a direction has not unit length", np.linalg.norm(directions, axis=1), 1, tolerance)


def check_density(what, sample, function, count, level, seed, cells=None):
    """Check that samples follow a density per solid angle whose integral is 1: a χ² test over cells of the sphere.

    Args:
        sample: (N, 2) random numbers → (N, 3) directions. count: how many are tested; level: of the test.
        function: (N, 3) directions → (N,) density; or (N, k), of which the first column is the density.
        cells: ``SphereCells``; chosen by other samples when None.

    Returns:
        The (count, 3) directions, and (k,) the integrals of all columns.
    """
    w_i = sample(uniform_pairs(count, seed=seed))
    check_unit(what, w_i)
    if cells is None:
        cells = SphereCells.of_samples(sample(uniform_pairs(10_000, seed=1000 + seed)))
    for halvings in (1, 3):  # the second time only if the integrals may be what is wrong
        integrals = cells.integrals(function, least_halvings=halvings)
        total, p = integrals.sum(axis=(0, 1)), chi_square_p(cells.counts(w_i), count * integrals[..., 0])
        if p > level:
            break
    assert abs(total[0] - 1) < PDF_TOLERANCE, f"{what}: the integral of pdf is {total[0]:.5f}"
    assert p > level, f"{what}: the samples are not those of pdf: p = {p:.1e}"
    return w_i, total


def uniform_pairs(count, seed):
    """(count, 2) random numbers below 1, in f32 too."""
    return np.random.default_rng(seed).random((count, 2), dtype=np.float32)


def directions_everywhere(count, seed=3):
    """(6 + count, 3) unit vectors: the axes, and others that are uniform on the sphere."""
    d = np.random.default_rng(seed).normal(size=(count, 3))
    return np.concatenate([np.eye(3), -np.eye(3), d / np.linalg.norm(d, axis=1, keepdims=True)])
