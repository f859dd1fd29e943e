"""Growth of an object in the picture, and the time until it reaches the camera's plane.

After S. Tourani, Introducing In-Frame Shear Constraints for Monocular Motion Segmentation, IIIT Hyderabad,
2015, section 3.1.1: the lengths between an object's points grow as it comes nearer. At depth Z a length goes
with 1/Z, and 1/length, which goes with Z, falls along a line where speed is steady: where that line meets
zero is the contact (D. Lee, A theory of visual control of braking based on information about
time-to-collision, Perception 5, 1976).

What turns grows too, but along one direction of the picture only. So growth is measured with its direction,
and what one direction has before the other counts half as growth and half as its error.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ifsvideo.objects.kinematics import accumulate, half_rows, local_lines
from ifsvideo.types import Floats

_LEAST_POINTS = 5
"""Fewest points whose lengths are compared."""
_MOST_PAIRS = 800
"""Most pairs of points whose lengths are compared; more cost time and say nothing new."""
_LEAST_LENGTH = 6.0
"""Shortest length, pixels: of a shorter one, the points' noise is no small share."""
_NOISE = 0.02
"""Least noise of a point, pixels; that of KLT at its best."""
_ROUNDS = 6
"""Rounds of reweighting; more change nothing that the points' noise does not hide."""
_STANDARD_ERRORS = 2.0
"""How many standard errors the growth must exceed; noise does so once in forty times."""

_LONGEST_S = 20.0
"""Longest time to contact that is told, seconds: nothing on a road keeps its speed for longer."""


@lru_cache(maxsize=1024)
def _pairs(points: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Both ends of the pairs that are compared: all, or every k-th."""
    first, second = np.triu_indices(points, 1)
    every = -(-len(first) // _MOST_PAIRS)
    return first[::every], second[::every]


def stretch(before: Floats, after: Floats) -> NDArray[np.float64]:
    """How an object's own lengths change between two frames.

    The logarithm of a length's growth is taken as ``a + b cos 2t + c sin 2t``, t being its direction: that is
    how a small piece of a plane that comes nearer and turns stretches. Fitted by least absolute deviations,
    weighted with the length: the weighted median over the pairs, for three unknowns in place of one.

    Parameters
    ----------
    before, after : (N, 2) float
        The same points in both frames, pixels.

    Returns
    -------
    (4,) float64
        a, b, c, and the standard error of a; NaN where points are few or near each other.
    """
    unknown = np.full(4, np.nan)
    if len(before) < _LEAST_POINTS:
        return unknown
    first, second = _pairs(len(before))
    edge, later = (np.asarray(xy, np.float64)[second] - xy[first] for xy in (before, after))
    length, grown = np.hypot(*edge.T), np.hypot(*later.T)
    kept = (length > _LEAST_LENGTH) & (grown > _LEAST_LENGTH)
    if np.count_nonzero(kept) < _LEAST_POINTS:
        return unknown
    growth = np.log(grown[kept] / length[kept])
    length = np.sqrt(length * grown)[kept]
    double = 2.0 * np.arctan2(edge[kept, 1], edge[kept, 0])
    design = np.stack([np.ones_like(double), np.cos(double), np.sin(double)], axis=1)
    residual = growth - np.median(growth)
    found = np.zeros(3)
    for _ in range(_ROUNDS):
        weighted = (length / np.maximum(np.abs(residual), _NOISE / length))[:, None] * design
        found = np.linalg.solve(_regular(weighted.T @ design), weighted.T @ growth)
        residual = growth - design @ found
    # A length's error is sqrt(2) times that of a point; n points make n (n - 1) / 2 pairs, but tell only
    # what n of them tell.
    noise = np.hypot(np.median(np.abs(residual) * length) / 0.6745 / np.sqrt(2.0), _NOISE)
    told = (np.square(length)[:, None] * design).T @ design / 2.0 * (len(before) - 1) / len(growth)
    error = noise * np.sqrt(np.linalg.inv(_regular(told))[0, 0])
    return np.append(found, error)


def _regular(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """The normal equations, solvable also where all pairs have one direction: then their error is large."""
    return np.asarray(normal + 1e-9 * np.trace(normal) * np.eye(3), np.float64)


@dataclass(frozen=True)
class Contact:
    """Growth and time to contact in each of N frames; see `ifsvideo.objects.history.ObjectTable`."""

    scale_rate: NDArray[np.float64]
    ttc_s: NDArray[np.float64]
    confidence: NDArray[np.float64]


def contact(stretches: Floats, fps: float) -> Contact:
    """Growth and time to contact of one object.

    Parameters
    ----------
    stretches : (N, 4) float
        As of `stretch`, into each of the N frames in which the object is seen.
    fps : float

    Returns
    -------
    Contact
        ``confidence`` is 1 less the relative error of the time, two standard errors of the growth: 0.8 where
        it is right within a fifth. There is no time where that is 0, nor one beyond 20 s.
    """
    stretches = np.asarray(stretches, np.float64)
    total, run = accumulate(stretches[:, :3])
    half = half_rows(fps)
    depth = local_lines(np.exp(-total[:, :1]), run, half)
    turning = local_lines(total[:, 1:], run, half)
    rate = (-depth.slope / depth.value)[:, 0] * fps
    # The points' noise, were it new in every frame, and how far the lengths are from a steady approach.
    formal = _running_median(stretches[:, 3], half) / np.sqrt(2.0)
    noise = np.hypot(formal, (depth.residual / depth.value)[:, 0]) * depth.leverage * fps
    lopsided = np.hypot(*turning.slope.T) * fps
    rate = np.sign(rate) * (np.abs(rate) - np.minimum(lopsided, np.abs(rate)) / 2.0)
    error = np.hypot(noise, lopsided / 2.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        confidence = np.where(rate > 0, 1.0 - _STANDARD_ERRORS * error / rate, 0.0)
    grows = (confidence > 0) & (rate > 1.0 / _LONGEST_S)
    ttc = np.full(len(rate), np.nan)
    ttc[grows] = 1.0 / rate[grows]
    return Contact(rate, ttc, np.where(grows, confidence, 0.0))


def _running_median(values: Floats, half: int) -> NDArray[np.float64]:
    """Median over each value's surroundings, of those that are known; NaN if none is."""
    window = sliding_window_view(np.pad(values, half, constant_values=np.nan), 2 * half + 1)
    known = np.isfinite(window).any(axis=1)
    median = np.full(len(values), np.nan)
    median[known] = np.nanmedian(window[known], axis=1)
    return median
