"""A clip in windows: which frames, which tracks, and what to say of the tracks that are too short for a
window."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ifsvideo.config import ObjectsConfig
from ifsvideo.types import BACKGROUND, UNDECIDED, Tracks

_REACH = 35.0
"""Distance over which a short track may take an object's label, pixels of a 640x480 picture."""
_NEIGHBOURS = 8
"""Neighbours that are asked for the label of a short track."""


def window_bounds(frames: int, fps: float | None, config: ObjectsConfig) -> list[tuple[int, int]]:
    """First and one past the last frame of each window; each overlaps half of the next, the last ends with
    the clip."""
    length = config.window_frames
    if fps is not None:
        length = min(length, max(config.least_frames, round(config.window_s * fps)))
    if frames <= length:
        return [(0, frames)] if frames else []
    starts = list(range(0, frames - length, max(length // 2, 1)))
    return [(start, start + length) for start in [*starts, frames - length]]


def follow_neighbours(
    tracks: Tracks, decided: NDArray[np.int64], labels: NDArray[np.int64], unit: float
) -> NDArray[np.int64]:
    """Labels of all tracks of a window, the short ones by the neighbours they move with.

    Parameters
    ----------
    decided : (D,) int
        Indices of the tracks that were segmented, ``labels`` (D,) their labels.
    unit : float
        Pixels per pixel of a 640x480 picture.

    Returns
    -------
    (P,) int
        -1 where no neighbour moves alike, or where the track is seen in a single frame.
    """
    result = np.full(tracks.points, UNDECIDED, dtype=np.int64)
    result[decided] = labels
    short = np.setdiff1d(np.arange(tracks.points), decided)
    usable = decided[labels != UNDECIDED]
    if not len(usable):
        return result
    for p in short:
        seen = np.flatnonzero(tracks.visible[:, p])
        if len(seen) < 2:
            continue
        result[p] = _vote(tracks, int(p), seen, usable, result, unit)
    return result


def _vote(
    tracks: Tracks,
    p: int,
    seen: NDArray[np.int64],
    usable: NDArray[np.int64],
    labels: NDArray[np.int64],
    unit: float,
) -> int:
    """Label of one short track: each near neighbour votes, the more the nearer and the more alike it
    moves."""
    middle = seen[len(seen) // 2]
    there = usable[tracks.visible[middle, usable]]
    if not len(there):
        return UNDECIDED
    distance, index = cKDTree(tracks.xy[middle, there]).query(
        tracks.xy[middle, p], k=min(_NEIGHBOURS, len(there))
    )
    near = there[np.atleast_1d(index)]
    both = tracks.visible[seen][:, near]
    offset = np.where(both[:, :, None], tracks.xy[seen][:, near] - tracks.xy[seen, p][:, None], np.nan)
    shared = both.sum(axis=0) >= 2
    if not shared.any():
        return UNDECIDED
    # Rigid neighbours keep their offset; perspective changes it in proportion to the way.
    slip = np.full(len(near), np.inf)
    slip[shared] = np.linalg.norm(
        np.nanmax(offset[:, shared], axis=0) - np.nanmin(offset[:, shared], axis=0), axis=1
    )
    way = np.linalg.norm(np.ptp(tracks.xy[seen, p], axis=0))
    excess = (slip - slip.min()) / (0.4 * unit + 0.04 * way)
    weight = np.exp(-excess) / (10 * unit + np.atleast_1d(distance))
    # An object's label is carried neither far nor to what moves otherwise: that is seldom a part of it.
    far = (np.atleast_1d(distance) > _REACH * unit) | (excess > 1)
    weight[(labels[near] > BACKGROUND) & far] = 0.0
    if not weight.any():
        return UNDECIDED
    candidates = np.unique(labels[near])
    support = [weight[labels[near] == c].sum() for c in candidates]
    return int(candidates[int(np.argmax(support))])
