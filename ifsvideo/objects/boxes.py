"""The box round an object, out of the points that are seen on it."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ifsvideo.output.hull import groups
from ifsvideo.types import Floats, Ints

_REACH = 0.045
"""Distance between neighbours that is bridged, share of the diagonal, as of the outline that is drawn."""
_TRIMMED = 2.0
"""Per cent of the points beyond each side: corners of the ground that ride along outside the outline."""
_MARGIN = 0.006
"""Distance of the outermost corners to the object's outline, share of the diagonal: 4 px at 640x360."""
_BORDER = 0.015
"""A side nearer to the picture's edge than this, share of the diagonal, lies on it: corners are not tracked
up to the edge."""
_STEADY_S = 0.3
"""Seconds to either side over whose boxes the median is taken."""


def point_box(xy: Floats, diagonal: float) -> NDArray[np.float64]:
    """Box round the largest group of points, less the outermost of them, plus a margin.

    Parameters
    ----------
    xy : (N, 2) float, pixels, N at least 1
    diagonal : float
        Of the picture, pixels.

    Returns
    -------
    (4,) float64
        Left, top, right, bottom, pixels.
    """
    group = groups(xy, _REACH * diagonal)
    main = xy[group == np.bincount(group).argmax()]
    low, high = np.percentile(main, [_TRIMMED, 100.0 - _TRIMMED], axis=0)
    return np.concatenate([low - _MARGIN * diagonal, high + _MARGIN * diagonal])


def steady_boxes(boxes: Floats, own: Floats, growth: Floats, fps: float, size: tuple[int, int]) -> Floats:
    """Boxes of one object, each the median of those shortly before and after, moved and scaled as it was.

    Parameters
    ----------
    boxes : (N, 4) float
        As of `point_box`, of the frames in which the object is seen, pixels.
    own : (N, 2) float
        The object's step into each of the frames, pixels; NaN where the frame before is missing.
    growth : (N,) float
        Logarithm of the growth of its lengths into each frame; NaN where not known.
    fps : float
    size : (width, height) of the picture
        What lies outside it is cut off.

    Returns
    -------
    (N, 4) float64
        Left, top, right, bottom, pixels.
    """
    boxes = np.asarray(boxes, np.float64)
    half = max(1, round(_STEADY_S * fps))
    run = np.cumsum(np.isnan(own).any(axis=1), dtype=np.intp)
    path = np.cumsum(np.nan_to_num(own), axis=0)
    size_log = np.cumsum(np.nan_to_num(growth))
    middle = (boxes[:, :2] + boxes[:, 2:]) / 2.0 - path
    reach = (boxes[:, 2:] - boxes[:, :2]) / 2.0 * np.exp(-size_log)[:, None]
    middle = _running_median(middle, run, half) + path
    reach = _running_median(reach, run, half) * np.exp(size_log)[:, None]
    found = np.hstack([middle - reach, middle + reach])
    edge = np.array([-0.5, -0.5, size[0] - 0.5, size[1] - 0.5])
    inwards = np.array([1, 1, -1, -1]) * (found - edge)
    return np.clip(np.where(inwards < _BORDER * np.hypot(*size), edge, found), -0.5, np.tile(edge[2:], 2))


def _running_median(values: Floats, run: Ints, half: int) -> NDArray[np.float64]:
    """Median (N, K) over the rows of the same run that are at most ``half`` off."""
    near = sliding_window_view(np.pad(run, half, constant_values=-1), 2 * half + 1) == run[:, None]
    window = sliding_window_view(np.pad(values, ((half, half), (0, 0))), 2 * half + 1, axis=0)
    return np.asarray(np.nanmedian(np.where(near[:, None, :], window, np.nan), axis=2), np.float64)
