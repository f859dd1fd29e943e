"""Noisy tracks made clean: what many points have in common is motion, what one has for itself is noise.

Where a tracker is off by a tenth of a pixel, as KLT is on good pictures, nothing is done. Where it is off by
half a pixel or more, what parts two motions drowns in the few frames and points that each stage looks at. A
few rigid motions span few dimensions together, noise spans all: so what no more than noise would have put
into a dimension is taken out of it. Then each track gives up the changes from frame to frame that no body
makes. The camera's own shake is kept: the path that all points share is taken off before, and laid on again
after.

References
----------
M. Gavish, D. L. Donoho. Optimal Shrinkage of Singular Values. IEEE Trans. Information Theory, 2017.
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
_LASTING = 0.5
"""Share of the frames in which a track is seen that joins the others' dimensions: of a shorter one, what it
would have there is mostly guessed."""
_ROUNDS = 10
"""Times that gaps take what the dimensions say, and these are found anew."""
_GAP = 3
"""Frames in a row that a track may miss and be taken for seen: a tenth of a second of most videos, in which
no body turns. Of a tenth of the observations, dropped by chance, all but a few are in such gaps."""
_FOLLOWS = 1e-4
"""Weight of smoothness where only gaps are filled: what was measured draws the curve."""


def noise_of(tracks: Tracks) -> float:
    """Noise of tracks, pixels: from the third differences of their ways beside the common one, the median
    over all; 0 where no track has four frames in a row."""
    third = np.diff(tracks.xy - _common_path(tracks)[:, None], n=_ORDER, axis=0)
    known = third[np.isfinite(third).all(axis=2)]
    return float(_SIGMA * np.median(np.abs(known)) / _THIRD) if len(known) else 0.0


def noisy(tracks: Tracks, unit: float) -> bool:
    """Whether tracks have more noise than they may have and stay as they are; unit as of `smoothed`."""
    return noise_of(tracks) > CLEAN * unit


def smoothed(tracks: Tracks, strength: float, unit: float) -> Tracks:
    """Tracks without their noise, where they have much.

    Parameters
    ----------
    tracks : Tracks
    strength : float
        What a squared third difference costs over a squared distance from the track that was cleared of what
        it does not share, at one pixel of noise (Whittaker's smoother, 1923); it grows with the variance of
        the noise. Changes of a period below ``2 pi strength ** (1 / 6)`` frames are then held back. 0 leaves
        tracks as they are.
    unit : float
        Pixels of the picture per pixel of a 640x480 one.
    """
    noise = noise_of(tracks)
    weight = strength * max((noise / unit) ** 2 - CLEAN**2, 0.0)
    if weight == 0 or tracks.frames <= _ORDER:
        return tracks
    found = _smooth(_shared(tracks, noise), weight)
    return replace(tracks, xy=np.where(tracks.visible[..., None], found, np.nan))


def filled(tracks: Tracks) -> Tracks:
    """Tracks without the short gaps inside their lives, in which they go on as smoothly as can be.

    Stages that want points seen in the same frames lose far more by a gap than it hides.
    """
    seen = tracks.visible
    frame = np.arange(tracks.frames)[:, None]
    before = np.maximum.accumulate(np.where(seen, frame, -tracks.frames), axis=0)
    after = np.minimum.accumulate(np.where(seen, frame, 2 * tracks.frames)[::-1], axis=0)[::-1]
    enough = seen.sum(axis=0) > _ORDER
    short = ~seen & (after - before <= _GAP + 1) & enough
    points = np.flatnonzero(short.any(axis=0))
    if not len(points):
        return tracks
    xy = tracks.xy.copy()
    found = _smooth(tracks.select(points), _FOLLOWS, _common_path(tracks))
    xy[:, points] = np.where(short[:, points, None], found, xy[:, points])
    return replace(tracks, xy=xy, visible=seen | short)


def _shared(tracks: Tracks, noise: float) -> Tracks:
    """Tracks cleared of what they do not share with others.

    Each singular value of the trajectory matrix (2F, P) shrinks to what it would be but for white noise of
    this strength, those to 0 that noise alone has (Gavish and Donoho, eq. 7): of all ways to shrink
    them, the one that comes nearest in the mean square.
    """
    lasting = np.flatnonzero(tracks.visible.mean(axis=0) >= _LASTING)
    if len(lasting) < 2:
        return tracks
    seen, whole = np.repeat(tracks.visible[:, lasting], 2, axis=0), without_gaps(tracks).xy[:, lasting]
    W = whole.transpose(0, 2, 1).reshape(2 * tracks.frames, len(lasting))
    few, many = sorted(W.shape)
    ratio, scale = few / many, noise * np.sqrt(many)
    found = W
    for _ in range(1 if seen.all() else _ROUNDS):
        guessed = np.where(seen, W, found)
        mean = guessed.mean(axis=1, keepdims=True)
        U, singular, Vt = np.linalg.svd(guessed - mean, full_matrices=False)
        y = np.maximum(singular / scale, 1 + np.sqrt(ratio))
        found = mean + (U * (scale * np.sqrt(np.maximum((y**2 - ratio - 1) ** 2 - 4 * ratio, 0)) / y)) @ Vt
    xy = tracks.xy.copy()
    xy[:, lasting] = found.reshape(tracks.frames, 2, len(lasting)).transpose(0, 2, 1)
    return replace(tracks, xy=np.where(tracks.visible[..., None], xy, np.nan))


def _smooth(tracks: Tracks, weight: float, path: Array | None = None) -> Array:
    """Smooth curves (F, P, 2) near the tracks in all frames, beside a path (F, 2), by default their own."""
    along = (_common_path(tracks) if path is None else path)[:, None]
    beside = np.nan_to_num(tracks.xy - along)
    D = np.diff(np.eye(tracks.frames), n=_ORDER, axis=0)
    seen = tracks.visible.T.astype(np.float64)
    # Short tracks leave their ends free: a little of the identity keeps the system regular.
    left = seen[:, :, None] * np.eye(tracks.frames) + weight * D.T @ D + 1e-9 * np.eye(tracks.frames)
    found = np.linalg.solve(left, seen[:, :, None] * beside.transpose(1, 0, 2)).transpose(1, 0, 2)
    return np.asarray(found + along)


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
