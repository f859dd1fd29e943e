"""Stage 1 as the thesis has it: background is what fundamental matrices explain (thesis 3.0.1, eq. 2.1)."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import Bools, Tracks

_FEWEST = 8
"""Points that a fundamental matrix needs."""


def sampson_distance(
    fundamental: NDArray[np.float64], first: NDArray[np.float64], second: NDArray[np.float64]
) -> NDArray[np.float64]:
    """First-order distance of pairs (N, 2), (N, 2) to ``x'^T F x = 0`` (thesis eq. 2.1), pixels, (N,)."""
    x = np.column_stack([first, np.ones(len(first))])
    y = np.column_stack([second, np.ones(len(second))])
    line2, line1 = x @ fundamental.T, y @ fundamental
    product = (y * line2).sum(axis=1)
    scale = (line2[:, :2] ** 2).sum(axis=1) + (line1[:, :2] ** 2).sum(axis=1)
    return np.asarray(np.abs(product) / np.sqrt(np.maximum(scale, 1e-24)))


def epipolar_support(tracks: Tracks, threshold: float, seed: int) -> NDArray[np.float64]:
    """Share of the frame pairs in which a point agrees with the fundamental matrix of most.

    Pairs are each point's first frame against every later one in which it is seen, F by least median of
    squares. With complete tracks that is the thesis's: the first frame of the window against every later one.

    Parameters
    ----------
    threshold : float
        Sampson distance of an inlier, pixels.

    Returns
    -------
    (P,) float
        0..1; 0 for a point never seen together with enough others.
    """
    cv2.setRNGSeed(seed)
    hits = np.zeros(tracks.points)
    tried = np.zeros(tracks.points)
    birth = np.argmax(tracks.visible, axis=0)
    for base in np.unique(birth):
        born = birth <= base if base == 0 else (birth <= base) & tracks.visible[base]
        fresh = birth == base
        for frame in range(base + 1, tracks.frames):
            both = born & tracks.visible[base] & tracks.visible[frame]
            if both.sum() < _FEWEST or not (both & fresh).any():
                continue
            first, second = tracks.xy[base, both], tracks.xy[frame, both]
            fundamental, _ = cv2.findFundamentalMat(first, second, cv2.FM_LMEDS)
            if fundamental is None or fundamental.shape != (3, 3):
                continue
            counted = both & fresh
            distance = sampson_distance(fundamental, tracks.xy[base, counted], tracks.xy[frame, counted])
            hits[counted] += distance < threshold
            tried[counted] += 1
    return np.divide(hits, tried, out=np.zeros(tracks.points), where=tried > 0)


def epipolar_split(tracks: Tracks, threshold: float, seed: int) -> Bools:
    """Background (P,) bool: inliers in at least half of the frame pairs."""
    return epipolar_support(tracks, threshold, seed) >= 0.5
