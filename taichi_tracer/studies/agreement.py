"""Do estimators that should have the same mean have it? What a student who replaced a part asks.

All estimators of direct light compute the same integral, and so do all paths. Each is rendered with several seeds in
the same time. The one with the smallest error is the reference: where another one differs from it by more than the
noise of both, at least one of the two is biased. The pictures are compared in blocks of pixels:

    z = (m − m_r) / √(v + v_r)

with the variances v of the means m of a block. Where few samples found most of the light of a block, its z is not
normal. So a single block decides nothing: the sum of all z, each limited to ±3, shows a bias: see ``bias.shift_of``.
If nothing is biased, it is above ``most`` for some estimator in one of a hundred checks (Bonferroni: the probability is
divided among the estimators).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np

from taichi_tracer.picture.metrics import BLOCK_SIDE, blocks_of, shift_of
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.variants import is_path, known, renderer_of

SEEDS = 4  # pictures of each estimator
FALSE_ALARMS = 0.01  # of checks in which all agree
Picture = tuple[np.ndarray, np.ndarray]  # and the variance of each pixel


@dataclass(frozen=True)
class Compared:
    """One estimator beside the reference.

    Attributes:
        name: of the estimator.
        shift, error: how the mean of the picture differs, as a fraction of the reference's, and its standard error.
        z: of the whole picture; NaN if its error is unknown. most: the largest |z| that is no alarm.
        blocks: (rows, columns) z of the blocks, with the top row first; 0 where nothing can be said.
        unseen: what light that no sample met may add, as a fraction of the mean.
    """

    name: str
    shift: float
    error: float
    z: float
    most: float
    blocks: np.ndarray
    unseen: float

    @property
    def agrees(self) -> bool:
        """Whether the difference may be noise."""
        return not abs(self.z) > self.most


@dataclass(frozen=True)
class Group:
    """Estimators that should have the same mean.

    Attributes:
        what: they compute, in words. reference: the name of the one with which the others are compared. of_reference:
            its relative error.
    """

    what: str
    reference: str
    of_reference: float
    others: tuple[Compared, ...]

    @property
    def agrees(self) -> bool:
        """Whether all of them agree with the reference."""
        return all(one.agrees for one in self.others)


def agreement(
    scene: SceneData,
    size: tuple[int, int],
    seconds: float,
    estimators: Sequence[str] | None = None,
    seed: int = 0,
    tell: Callable[[str, float], Any] = lambda what, share: None,
) -> list[Group]:
    """Compare estimators that should agree.

    Args:
        size: width and height. seconds: of rendering, for all together.
        estimators: their names; None takes all that are registered.
        tell: is called with what is rendered, and the share of the work that is done.
    """
    names = known("estimators") if estimators is None else tuple(estimators)
    groups = [tuple(n for n in names if is_path(n) == kind) for kind in (False, True)]
    groups = [group for group in groups if len(group) > 1]
    pairs = sum(len(group) - 1 for group in groups)
    found, done, count = [], 0, sum(map(len, groups))
    for group in groups:
        rendered = {}
        for name in group:
            tell(name, done / count)
            rendered[name] = pictures_of(scene, name, size, seconds / count / SEEDS, seed)
            done += 1
        reference = min(group, key=lambda name: rendered[name].error)
        others = [compared(rendered[n], rendered[reference], pairs) for n in group if n != reference]
        what = "light over several surfaces" if is_path(group[0]) else "direct light"
        found.append(Group(what, reference, rendered[reference].error, tuple(others)))
    return found


@dataclass(frozen=True)
class Rendered:
    """The pictures of an estimator, its relative error, and what may be unseen."""

    name: str
    pictures: list[Picture]
    error: float
    unseen: float

    @property
    def mean(self) -> Picture:
        """The mean of all pictures."""
        images, variances = zip(*self.pictures, strict=True)
        return np.mean(images, axis=0), np.mean(variances, axis=0) / len(images)


def pictures_of(scene: SceneData, name: str, size: tuple[int, int], seconds: float, seed: int) -> Rendered:
    """Render an estimator with several seeds; all have as many samples as the first, which takes the seconds."""
    pictures: list[Picture] = []
    limit: dict[str, Any] = {"time": seconds}
    errors = []
    for k in range(SEEDS):
        renderer = renderer_of(name)(scene, *size, seed=seed + k).use(name).render(**limit)
        limit = {"spp": renderer.samples}
        errors.append(renderer.error())
        pictures.append((renderer.image().astype(np.float64), np.square(renderer.error_image(), dtype=np.float64)))
    unseen = max(getattr(found, "unseen", 0.0) for found in errors)
    error = math.sqrt(np.square(errors).mean() / SEEDS)
    return Rendered(name, pictures, math.inf if math.isnan(error) else math.hypot(error, unseen), unseen)


def compared(one: Rendered, reference: Rendered, pairs: int) -> Compared:
    """An estimator beside the reference.

    Args:
        pairs: how many are compared in the whole check.
    """
    unseen = math.hypot(one.unseen, reference.unseen)
    shift, error, z = shift_of(one.pictures, reference.mean, unseen)
    if math.isinf(one.error):
        z = math.nan
    blocks = block_scores(one.mean, reference.mean, unseen * float(reference.mean[0].mean()))
    most = NormalDist().inv_cdf(1 - FALSE_ALARMS / 2 / pairs)
    return Compared(one.name, shift, error, z, most, blocks, unseen)


def block_scores(one: Picture, reference: Picture, unseen: float) -> np.ndarray:
    """(rows, columns) z of every block of pixels.

    Args:
        unseen: what light that no sample met may add, in the unit of the picture; it counts as noise of every block.
    """
    difference = (one[0] - reference[0]).mean(axis=2)
    variance = (np.nan_to_num(one[1]) + np.nan_to_num(reference[1])).sum(axis=2) / 3  # channels err together
    side = min(BLOCK_SIDE, *difference.shape)
    d, v = blocks_of(difference), blocks_of(variance) / side**2 + unseen**2
    return np.divide(d, np.sqrt(v), out=np.zeros_like(d), where=v > 0)
