"""Outlines of objects as a few numbers each: distances from a middle point in fixed directions."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from ifsvideo.output import hull
from ifsvideo.types import Floats

DIRECTIONS = 24
"""Evenly spaced, the first to the right, then clockwise on the screen: a few pixels of a corner are lost at
640x360, and a second of a clip stays small."""
_REACH, _MARGIN = 0.045, 0.01
"""As of the outline that the overlay draws, shares of the diagonal; it is a little tighter."""
_STEADY = 5
"""Outlines of which the median is taken; a third of a second."""
_ANGLES = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
_UNIT = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)


def outline(xy: Floats, diagonal: float) -> NDArray[np.float32]:
    """The largest outline round an object's points.

    Parameters
    ----------
    xy : (N, 2) float, pixels, N at least 1
    diagonal : float
        Of the picture, pixels.

    Returns
    -------
    (2 + DIRECTIONS,) float32
        Middle point x, y, and from it the distance to the outline in each direction, pixels.
    """
    polygon = hull.outlines(xy, _REACH * diagonal, _MARGIN * diagonal)[0]
    middle = _centroid(polygon)
    return np.concatenate([middle, _distances(polygon - middle)]).astype(np.float32)


def steady(outlines: Floats, boxes: Floats) -> NDArray[np.float32]:
    """The outlines of one object without the twitches of corners that come and go.

    Parameters
    ----------
    outlines : (N, 2 + DIRECTIONS) float
        As of `outline`, in the order of time.
    boxes : (N, 4) float
        Left, top, width and height at these times, steady already (`ifsvideo.objects.boxes`), pixels: each
        outline is the median of those round it, moved and scaled as the box was.

    Returns
    -------
    (N, 2 + DIRECTIONS) float32
    """
    scale = np.sqrt(np.maximum(boxes[:, 2] * boxes[:, 3], 1.0))[:, None]
    middle = np.zeros_like(outlines)
    middle[:, :2] = boxes[:, :2] + boxes[:, 2:] / 2
    relative = median_filter((outlines - middle) / scale, size=(_STEADY, 1), mode="nearest")
    return np.asarray(middle + relative * scale, np.float32)


def _centroid(polygon: NDArray[np.float32]) -> NDArray[np.float64]:
    moments = cv2.moments(polygon)
    return np.array([moments["m10"], moments["m01"]]) / moments["m00"]


def _distances(corners: Floats) -> NDArray[np.float64]:
    """How far a convex polygon round the origin reaches in each direction."""
    along = np.roll(corners, -1, axis=0) - corners
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    offset = (outward * corners).sum(axis=1)
    outward, offset = outward * np.sign(offset)[:, None], np.abs(offset)
    facing = outward @ _UNIT.T
    # A ray leaves a convex polygon through the nearest of the sides that it faces.
    reach = np.where(facing > 1e-9, offset[:, None] / np.maximum(facing, 1e-9), np.inf)
    return np.asarray(reach.min(axis=0))
