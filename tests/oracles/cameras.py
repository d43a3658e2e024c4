"""Rays of the perspective and the orthographic camera by RT-1 … RT-5, in float64."""

import numpy as np


def frame(look_from, look_at, up, handedness="left"):
    """û, v̂, ŵ of the left-handed frame (RT-1); û turned round for "right"."""
    look_from, look_at, up = (np.asarray(v, np.float64) for v in (look_from, look_at, up))
    w = (look_at - look_from) / np.linalg.norm(look_at - look_from)
    u = np.cross(up, w)
    u /= np.linalg.norm(u)
    v = np.cross(w, u)
    v /= np.linalg.norm(v)
    return (u if handedness == "left" else -u), v, w


def window(n_x, n_y, screen_window=None, fovy=None, frame_aspect=None, focal_distance=1.0):
    """(l, r, b, t): as given, of the angle, or [−1, 1] along the shorter axis."""
    if screen_window is not None:
        return tuple(screen_window)
    aspect = n_x / n_y if frame_aspect is None else frame_aspect
    if fovy is not None:
        half = np.tan(np.radians(fovy / 2)) * focal_distance
        return -half * aspect, half * aspect, -half, half
    if aspect >= 1:
        return -aspect, aspect, -1.0, 1.0
    return -1.0, 1.0, -1 / aspect, 1 / aspect


def rays(projection, n_x, n_y, look_from, look_at, up, handedness="left", focal_distance=1.0, i=None, j=None, **shape):
    """(n_y, n_x, 3) origins and unit directions, row 0 at the bottom; i and j may be fractions of a pixel."""
    l, r, b, t = window(n_x, n_y, focal_distance=focal_distance, **shape)
    i = np.arange(n_x) if i is None else np.asarray(i)
    j = np.arange(n_y) if j is None else np.asarray(j)
    x = (l + (r - l) * (i + 0.5) / n_x)[None, :, None]
    y = (b + (t - b) * (j + 0.5) / n_y)[:, None, None]
    u, v, w = frame(look_from, look_at, up, handedness)
    e = np.asarray(look_from, np.float64)
    if projection == "orthographic":
        o = e + x * u + y * v
        return o, np.broadcast_to(w, o.shape)
    d = focal_distance * w + x * u + y * v
    return np.broadcast_to(e, d.shape), d / np.linalg.norm(d, axis=-1, keepdims=True)
