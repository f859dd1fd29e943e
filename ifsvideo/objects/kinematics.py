"""How an object moves in the picture: its step from frame to frame, beside that of the background around it.

Steps are medians over points. Added up, they are a path, and a line fitted to a short stretch of the path is
the velocity: what one frame gets wrong and the next puts right does no harm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ifsvideo.types import Floats

REACH_S = 0.3
"""Seconds to either side over which velocity and growth are taken: long enough for a far car of ten points to
grow beyond their noise, short enough for its speed to be steady."""
_LEAST_OWN = 3
"""Fewest points whose median step is taken for the object's."""
_FOOT = 0.25
"""How far above or below an object's foot the ground is looked at, share of the object's height."""
_LEAST_AROUND = 8
"""Fewest points of the background that must be in sight."""
_AROUND = 24
"""Points of the background, the nearest to the object's middle, whose median step is taken for that of the
background around it."""


def steps(
    before: Floats, after: Floats, ground_before: Floats, ground_after: Floats
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Step of an object and of the background around it, between two frames.

    Parameters
    ----------
    before, after : (N, 2) float
        The object's points seen in both frames, pixels.
    ground_before, ground_after : (M, 2) float
        The background's.

    Returns
    -------
    own, around : (2,) float64
        Pixels; NaN where there are too few points.
    """
    own = around = np.full(2, np.nan)
    if len(after) >= _LEAST_OWN:
        own = np.median(after - before, axis=0).astype(np.float64)
    if len(after) and len(ground_after) >= _LEAST_AROUND:
        distance = np.square(ground_after - np.median(after, axis=0)).sum(axis=1)
        count = min(_AROUND, len(distance))
        near = np.argpartition(distance, count - 1)[:count]
        around = np.median(ground_after[near] - ground_before[near], axis=0).astype(np.float64)
    return own, around


def foot_step(
    own: Floats, growth: float, after: Floats, box: Floats, ground_before: Floats, ground_after: Floats
) -> float:
    """How far an object's foot goes down the picture between two frames, beside the ground there.

    The ground at the foot's height in the picture is as far away as the object, where the ground is flat. So
    this is above 0 for what comes towards us over the ground, below it for what goes our way.

    Parameters
    ----------
    own : (2,) float
        As of `steps`.
    growth : float
        Logarithm of the growth of the object's lengths; NaN where not known.
    after : (N, 2) float
        The object's points, pixels.
    box : (4,) float
        Left, top, right, bottom, pixels.
    ground_before, ground_after : (M, 2) float
        The background's points seen in both frames.

    Returns
    -------
    float
        Pixels; NaN where nothing can be said.
    """
    left, top, right, bottom = box.tolist()
    width, height = right - left, bottom - top
    x, y = np.asarray(ground_after).T
    beside = (np.abs(y - bottom) < _FOOT * height) & (x > left - width) & (x < right + width)
    if np.count_nonzero(beside) < _LEAST_OWN or not len(after):
        return float("nan")
    foot = own[1] + growth * (bottom - np.median(after[:, 1]))
    return float(foot - np.median((ground_after - ground_before)[beside, 1]))


@dataclass(frozen=True)
class LocalLines:
    """Lines fitted to the surroundings of each of N values, evaluated there.

    Attributes
    ----------
    value, slope : (N, K) float64
        Slope per row; NaN where too few rows are near.
    residual : (N, K) float64
        Root mean square distance of the rows to the line.
    leverage : (N,) float64
        Standard error of the slope, per unit of the values' error.
    """

    value: NDArray[np.float64]
    slope: NDArray[np.float64]
    residual: NDArray[np.float64]
    leverage: NDArray[np.float64]


def accumulate(increments: Floats) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Sums (N, K) of increments (N, K), and the run (N,) of each row; a row with NaN begins a run."""
    broken = np.asarray(np.isnan(increments).any(axis=1))
    return np.cumsum(np.where(broken[:, None], 0.0, increments), axis=0), np.cumsum(broken)


def local_lines(values: Floats, run: NDArray[np.intp], half: int) -> LocalLines:
    """Fit a line to each value and those up to ``half`` rows off in its run, the nearer the weightier.

    Parameters
    ----------
    values : (N, K) float
        One row a frame.
    run : (N,) int
        Rows of one number are consecutive frames.
    half : int
        At least 1. Where no more than this many rows are near, NaN.
    """
    offset = np.arange(-half, half + 1.0)
    padded_run = np.pad(run, half, constant_values=-1)
    near = sliding_window_view(padded_run, 2 * half + 1) == run[:, None]
    weight = near * (1.0 - np.square(offset / (half + 1.0)))  # Epanechnikov's kernel
    padded = np.pad(np.asarray(values, np.float64), ((half, half), (0, 0)))
    window = sliding_window_view(padded, 2 * half + 1, axis=0)  # (N, K, 2 half + 1)
    s0, s1, s2 = (weight @ offset**power for power in range(3))
    spread = np.where(near.sum(axis=1) > half, s0 * s2 - s1**2, np.nan)
    t0 = np.einsum("nkw,nw->nk", window, weight)
    t1 = np.einsum("nkw,nw->nk", window, weight * offset)
    value = (t0 * s2[:, None] - t1 * s1[:, None]) / spread[:, None]
    slope = (t1 * s0[:, None] - t0 * s1[:, None]) / spread[:, None]
    miss = window - value[:, :, None] - slope[:, :, None] * offset
    residual = np.sqrt(np.einsum("nkw,nw->nk", np.square(miss), weight) / s0[:, None])
    pull = weight * (s0[:, None] * offset - s1[:, None]) / spread[:, None]
    return LocalLines(value, slope, residual, np.sqrt(np.square(pull).sum(axis=1)))


def velocity(own: Floats, around: Floats, fps: float) -> NDArray[np.float64]:
    """Velocity (N, 2) of an object against the background around it, pixels per second.

    Parameters
    ----------
    own, around : (N, 2) float
        Steps into each of N frames in which it is seen, as of `steps`; NaN where the frame before is missing.
    """
    path, run = accumulate(np.asarray(own) - around)
    return local_lines(path, run, half_rows(fps)).slope * fps


def half_rows(fps: float) -> int:
    """`REACH_S` in frames; at least two, since a line through two points tells nothing of their noise."""
    return max(2, round(REACH_S * fps))
