"""Adaptive sampling: more samples where the picture is noisier.

The error of a picture is smallest, for a number of samples, when every pixel takes them in proportion to the standard
deviation of one (Neyman 1934). A pilot estimates that deviation, from random numbers of its own, and is thrown away:
the number of samples of a pixel then depends on nothing that is added up in it, so that its mean is unbiased. Adding
samples "until the pixel looks good" is not: it stops where the first ones happened to agree (Kirk & Arvo, "Unbiased
sampling techniques for image synthesis", SIGGRAPH 1991).
"""

import numpy as np

from taichi_tracer.fast.primary_hits import WHOLE
from taichi_tracer.picture.progress import Progress

PILOT = 16  # samples per pixel
PILOT_SEED = 0x9E3779B9  # other random numbers than those of the picture
SMALLEST = 1 / 8  # share of the samples of a pixel in which the pilot saw no noise: it may have missed it
MOST = 0.99  # pixels above this quantile of the deviation take part in every pass: a few would slow down all


def adapt(renderer) -> Progress:
    """Render the pilot, and give every pixel its share of the passes; returns what the pilot took."""
    seed, first = renderer.seed, renderer.first_sample
    renderer.hits.share.fill(WHOLE)
    renderer.seed, renderer.first_sample, renderer.mean_share = seed ^ PILOT_SEED, 0, 1.0
    renderer.adaptive = False
    try:
        renderer.render(PILOT, watch=lambda _: None)
        deviation = renderer.film.sample_deviation()
        pilot = renderer.progress
    finally:
        renderer.adaptive, renderer.seed, renderer.first_sample = True, seed, first
    shares = shares_of(deviation)
    renderer.hits.set_shares(shares)
    renderer.mean_share = float(shares.mean()) / WHOLE
    renderer.reset()
    return pilot


def shares_of(deviation: np.ndarray) -> np.ndarray:
    """(h, w) int32 in 1/256 from the (h, w) standard deviation of one sample of every pixel."""
    largest = np.quantile(deviation, MOST)
    share = deviation / largest if largest > 0 else np.ones_like(deviation)
    return np.ceil(np.clip(share, SMALLEST, 1) * WHOLE).astype(np.int32)
