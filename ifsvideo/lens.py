"""Radial distortion of a wide lens, one parameter, and how it is taken out of coordinates.

The model: what a pinhole camera would show at distance ``r`` from the picture's centre, the lens shows at
``r (1 + k1 r^2)`` on the same ray. ``r`` counts in half diagonals of the picture and is 1 in its corners; the
middle of the picture keeps its scale. A wide lens pulls the corners in: ``k1 < 0`` (barrel). It is Brown's
model (Decentering Distortion of Lenses, 1966) cut after its first term, and that of ffmpeg's filter
``lenscorrection``, whose ``k1`` is the same number. OpenCV's ``k1`` counts in focal lengths: times
``(half diagonal / focal length)^2``, both in pixels, it is this one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ifsvideo.errors import UsageError

K1_LEAST, K1_MOST = -4 / 27, 1.0
"""Range of k1. At -4/27 the corners would be the rim of all that the lens shows: farther out, the model turns
back. It is a lens that sees about 120 degrees from corner to corner; a fisheye needs another model."""
_STEPS = 30
"""Newton's steps at most; near the least k1 the slope in the corners is nearly 0 and a step
only halves the error."""


def check_k1(k1: float, name: str = "k1") -> None:
    """Refuse a parameter that cannot be undone everywhere in the picture.

    Raises
    ------
    UsageError
        If it is not above `K1_LEAST` and at most `K1_MOST`.
    """
    if not K1_LEAST < k1 <= K1_MOST:
        raise UsageError(f"{name} must be above -4/27 (-0.148) and at most 1, got {k1:g}")


def distort(xy: NDArray[Any], size: tuple[int, int], k1: float) -> NDArray[np.float64]:
    """Where the lens shows what a pinhole camera would show at ``xy``.

    Parameters
    ----------
    xy : (..., 2) float
        Pixels, the centre of the top-left one is (0, 0).
    size : (width, height) of the picture, pixels.
    k1 : float
        See the model above.

    Returns
    -------
    (..., 2) float, pixels
    """
    centre, unit = _picture(size)
    ray = (np.asarray(xy, dtype=np.float64) - centre) / unit
    return np.asarray(centre + unit * ray * (1 + k1 * (ray**2).sum(axis=-1, keepdims=True)))


def undistort(xy: NDArray[Any], size: tuple[int, int], k1: float) -> NDArray[np.float64]:
    """Where a pinhole camera would show what the lens shows at ``xy``; the inverse of `distort`.

    Parameters
    ----------
    xy : (..., 2) float
        Pixels, the centre of the top-left one is (0, 0); NaN stays NaN. With a wide lens a point outside the
        circle round the picture, where the model has no inverse, is moved as far as one on it.
    size : (width, height) of the picture, pixels.
    k1 : float
        See the model above.

    Returns
    -------
    (..., 2) float
        Pixels of the pinhole picture, on the same grid; with a wide lens the corners lie outside it.

    Raises
    ------
    UsageError
        If ``k1`` is out of range.
    """
    check_k1(k1)
    centre, unit = _picture(size)
    ray = (np.asarray(xy, dtype=np.float64) - centre) / unit
    shown = np.linalg.norm(ray, axis=-1, keepdims=True)
    if k1 < 0:
        shown = np.minimum(shown, 1.0)
    # Newton's method on r (1 + k1 r^2) = shown. From this side of the root it never oversteps.
    r = shown.copy()
    for _ in range(_STEPS):
        step = (r * (1 + k1 * r**2) - shown) / (1 + 3 * k1 * r**2)
        r -= step
        if np.nanmax(np.abs(step), initial=0.0) < 1e-12:
            break
    return np.asarray(centre + unit * ray * np.divide(r, shown, out=np.ones_like(r), where=shown > 0))


def _picture(size: tuple[int, int]) -> tuple[NDArray[np.float64], float]:
    """Centre and half diagonal of a picture, pixels."""
    width, height = size
    return np.array([(width - 1) / 2, (height - 1) / 2]), float(np.hypot(width, height)) / 2
