"""An environment: the light that arrives from far away, from every direction."""

import numpy as np

import taichi_tracer as tt

HEIGHT = 256  # of the image, in texels


@tt.register
class Mine(tt.Environment):
    """A sky that is bright at the horizon, with a sun: an image, so that its bright places are sampled more often.

    The rows of the image are latitudes, from +y down to −y; its columns go round +y. Values are radiance, linear RGB.
    """

    name = "mine"

    def __init__(self, **options):
        """``options`` are those of ``tt.Environment``: intensity, rotation, lookup."""
        row, column = np.mgrid[0.5:HEIGHT, 0.5 : 2 * HEIGHT]
        latitude, azimuth = np.pi * (0.5 - row / HEIGHT), np.pi * (column / HEIGHT - 1)
        across = np.cos(latitude)
        d = np.stack([across * np.cos(azimuth), np.sin(latitude), across * np.sin(azimuth)], axis=-1)
        super().__init__(self.sky(d), **options)

    def sky(self, d):
        """(h, w, 3) radiance from (h, w, 3) unit directions."""
        up = np.clip(d[..., 1:2], 0, 1)
        sun = d @ np.array([0.48, 0.6, 0.64]) > np.cos(np.radians(3))
        return (1 - up) * np.array([0.9, 0.8, 0.7]) + up * np.array([0.2, 0.4, 0.9]) + 60.0 * sun[..., None]
