"""What stands behind a scene, in float64: pictures (height, width, 3) with the top row first."""

import numpy as np


def corners(width, height, bl, tl, tr, br):
    """Four colours, bilinear at the pixels' centres; (0, 0) of the frame is the bottom left."""
    s = ((np.arange(width) + 0.5) / width)[None, :, None]
    t = ((np.arange(height) + 0.5) / height)[::-1, None, None]
    bl, tl, tr, br = (np.asarray(c, np.float64) for c in (bl, tl, tr, br))
    return (1 - s) * (1 - t) * bl + (1 - s) * t * tl + s * t * tr + s * (1 - t) * br


def stretched(width, height, image):
    """An image over the whole frame, bilinear between its texels' centres, its border kept."""
    image = np.asarray(image, np.float64)
    rows, columns = image.shape[:2]
    x = np.clip((np.arange(width) + 0.5) / width * columns - 0.5, 0, columns - 1)
    y = np.clip((np.arange(height) + 0.5) / height * rows - 0.5, 0, rows - 1)
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    x1, y1 = np.minimum(x0 + 1, columns - 1), np.minimum(y0 + 1, rows - 1)
    fx, fy = (x - x0)[None, :, None], (y - y0)[:, None, None]
    top = (1 - fx) * image[y0][:, x0] + fx * image[y0][:, x1]
    return (1 - fy) * top + fy * ((1 - fx) * image[y1][:, x0] + fx * image[y1][:, x1])
