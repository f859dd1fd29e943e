"""Noisy tracks made smooth: motion is, noise is not.

Where a tracker is off by a tenth of a pixel, as KLT is on good pictures, nothing is done. Where it is off by
half a pixel or more, what parts two motions drowns in the few frames and points that each stage looks at; so
each track gives up the changes from frame to frame that no body makes. The camera's own shake is kept: the
path that all points share is taken off before, and laid on again after.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import Tracks

Array = NDArray[np.float64]

CLEAN = 0.25
"""Noise up to which tracks stay as they are, pixels of a 640x480 picture. KLT is below it on the sample clips
and on both benchmarks, but for a few of the articulated sequences of Hopkins-155."""
_ORDER = 3
"""Differences that are small for a body: the third, so that steady acceleration costs nothing."""
_THIRD = np.sqrt(20.0)
"""Standard deviation of third differences over that of white noise: 1, 3, 3, 1."""
_SIGMA = 1.4826
"""Standard deviation of normal noise over its median absolute value."""


def noise_of(tracks: Tracks) -> float:
    """Noise of tracks, pixels: from the third differences of their ways beside the common one, the median
    over all; 0 where no track has four frames in a row."""
    third = np.diff(tracks.xy - _common_path(tracks)[:, None], n=_ORDER, axis=0)
    known = third[np.isfinite(third).all(axis=2)]
    return float(_SIGMA * np.median(np.abs(known)) / _THIRD) if len(known) else 0.0


def smoothed(tracks: Tracks, strength: float, unit: float) -> Tracks:
    """Tracks without their noise, where they have much.

    Parameters
    ----------
    tracks : Tracks
    strength : float
        What a squared third difference costs over a squared distance from the measurement, at one pixel of
        noise (Whittaker's smoother, 1923); it grows with the variance of the noise. Changes of a period below
        ``2 pi strength ** (1 / 6)`` frames are then held back. 0 smoothes nothing.
    unit : float
        Pixels of the picture per pixel of a 640x480 one.
    """
    weight = strength * max((noise_of(tracks) / unit) ** 2 - CLEAN**2, 0.0)
    if weight == 0 or tracks.frames <= _ORDER:
        return tracks
    path = _common_path(tracks)[:, None]
    beside = np.nan_to_num(tracks.xy - path)
    D = np.diff(np.eye(tracks.frames), n=_ORDER, axis=0)
    seen = tracks.visible.T.astype(np.float64)
    # Short tracks leave their ends free: a little of the identity keeps the system regular.
    left = seen[:, :, None] * np.eye(tracks.frames) + weight * D.T @ D + 1e-9 * np.eye(tracks.frames)
    found = np.linalg.solve(left, seen[:, :, None] * beside.transpose(1, 0, 2)).transpose(1, 0, 2)
    return replace(tracks, xy=np.where(tracks.visible[..., None], found + path, np.nan))


def without_gaps(tracks: Tracks) -> Tracks:
    """The same tracks seen in every frame: between two measurements each goes straight, beside the path that
    most have in common, and before the first and after the last it stays beside it.

    A place to start from where a method needs every point in every frame, never a measurement.
    """
    if tracks.visible.all():
        return tracks
    path, xy = _common_path(tracks), tracks.xy.copy()
    for point in np.flatnonzero(~tracks.visible.all(axis=0)):
        seen, gaps = np.flatnonzero(tracks.visible[:, point]), np.flatnonzero(~tracks.visible[:, point])
        beside = xy[seen, point] - path[seen]
        for axis in (0, 1):
            xy[gaps, point, axis] = np.interp(gaps, seen, beside[:, axis]) + path[gaps, axis]
    return replace(tracks, xy=xy, visible=np.ones_like(tracks.visible))


def _common_path(tracks: Tracks) -> Array:
    """The way (F, 2) that most points have in common: the median step of each frame, summed up."""
    common = np.zeros((tracks.frames, 2))
    for frame, step in enumerate(np.diff(tracks.xy, axis=0)):
        known = step[np.isfinite(step[:, 0])]
        if len(known):
            common[frame + 1] = np.median(known, axis=0)
    return np.cumsum(common, axis=0)
