"""A clip in windows: which frames, which tracks, and what each window says of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.standing_camera import add_movers, add_vanished, sure_of_added
from ifsvideo.types import BACKGROUND, UNDECIDED, Bools, FramePoints, Segmenter, Tracks

_REACH = 35.0
"""Distance over which a short track may take an object's label, pixels of a 640x480 picture."""
_NEIGHBOURS = 8
"""Neighbours that are asked for the label of a short track."""
_ALL_ROUND = 4
"""Neighbours that must agree on the label of a track that is seen in a single frame."""

Bounds = tuple[int, int]
"""First and one past the last frame of a window."""


@dataclass(frozen=True)
class WindowSize:
    """How many frames a window spans, and every how manyth of them it looks at."""

    length: int
    stride: int

    @classmethod
    def at(cls, fps: float | None, config: ObjectsConfig) -> WindowSize:
        """A second where the rate allows: at high rates not every frame is looked at, at low ones it is
        longer."""
        if fps is None:
            return cls(config.window_frames, 1)
        stride = max(1, round(config.window_s * fps / config.window_frames))
        looked_at = min(config.window_frames, max(config.least_frames, round(config.window_s * fps / stride)))
        return cls(looked_at * stride, stride)

    @property
    def step(self) -> int:
        """Frames from one window to the next: half of each lies in the next."""
        return max(self.length // 2 // self.stride, 1) * self.stride


class Windows:
    """The windows of a clip whose end is not known beforehand."""

    def __init__(self, size: WindowSize) -> None:
        self._size = size
        self._start = 0
        self._last = 0
        self.count = 0
        """Windows so far."""

    def complete(self, frames: int) -> Bounds | None:
        """The next window, once so many frames are there."""
        stop = self._start + self._size.length
        if stop > frames:
            return None
        window = (self._start, stop)
        self._start += self._size.step
        self._last = stop
        self.count += 1
        return window

    def end(self, frames: int) -> Bounds | None:
        """The window that ends with the clip, where the others left frames over."""
        if frames == self._last:
            return None
        self.count += 1
        return max(0, frames - self._size.length), frames


def window_bounds(frames: int, fps: float | None, config: ObjectsConfig) -> list[Bounds]:
    """First and one past the last frame of each window; each overlaps half of the next, the last ends with
    the clip."""
    windows = Windows(WindowSize.at(fps, config))
    bounds: list[Bounds] = []
    while (window := windows.complete(frames)) is not None:
        bounds.append(window)
    last = windows.end(frames)
    return bounds if last is None else [*bounds, last]


def gather(
    frames: Sequence[FramePoints], size: tuple[int, int] | None = None, fps: float | None = None
) -> Tracks:
    """Dense tracks of the frames of a window: every track seen at least once there."""
    counts = [len(frame.ids) for frame in frames]
    every = np.concatenate([frame.ids for frame in frames])
    ids, column = np.unique(every, return_inverse=True)
    row = np.repeat(np.arange(len(frames)), counts)
    xy = np.full((len(frames), len(ids), 2), np.nan)
    visible = np.zeros(xy.shape[:2], dtype=bool)
    xy[row, column] = np.concatenate([frame.xy for frame in frames])
    visible[row, column] = True
    return Tracks(xy, visible, ids.astype(np.int64), size, fps)


def long_enough(tracks: Tracks, config: ObjectsConfig) -> Bools:
    """Which tracks (P,) of a window last long enough to be segmented."""
    least = max(2, config.least_life * tracks.frames)
    return np.asarray(tracks.visible.sum(axis=0) >= least, bool)


@dataclass(frozen=True)
class WindowLabels:
    """What a window says of its tracks.

    Attributes
    ----------
    labels : (P,) int64
        0 background, 1, 2, ... moving, -1 undecided.
    confidence : (P,) float64
        As in `ifsvideo.types.Segmentation`; 0 where a track only follows others.
    """

    labels: NDArray[np.int64]
    confidence: NDArray[np.float64]


@dataclass(frozen=True)
class WindowLabeller:
    """Labels all tracks of a window: those that last are segmented, the others follow their neighbours.

    Parameters
    ----------
    segmenter : Segmenter
    config : ObjectsConfig
    motions : int, optional
        Number of motions, where it is known.
    """

    segmenter: Segmenter
    config: ObjectsConfig
    motions: int | None = None

    def __call__(self, tracks: Tracks) -> WindowLabels:
        """Label every track of a window."""
        lasting = np.flatnonzero(long_enough(tracks, self.config))
        confidence = np.zeros(tracks.points)
        if not len(lasting):
            return WindowLabels(np.full(tracks.points, UNDECIDED, dtype=np.int64), confidence)
        found = self.segmenter.segment(tracks.select(lasting), self.motions)
        # Who knows the number of motions has said that there are so many.
        confidence[lasting] = found.confidence if self.motions is None else 1.0
        unit = float(np.hypot(*tracks.size)) / 800 if tracks.size else 1.0
        labels = followed = follow_neighbours(tracks, lasting, found.labels, unit)
        if self.motions is None:
            labels = add_movers(tracks, lasting, followed, unit)
            confidence = np.maximum(confidence, sure_of_added(labels, labels != followed))
        labels = follow_all_round(tracks, labels, unit)
        return WindowLabels(add_vanished(tracks, lasting, labels, unit), confidence)


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
    usable = decided[labels != UNDECIDED]
    count = tracks.visible.sum(axis=0)
    short = np.setdiff1d(np.flatnonzero(count >= 2), decided)
    if len(short) and len(usable):
        distance, near = _neighbours(tracks, short, usable)
        result[short] = _votes(tracks, short, distance, near, result, unit)
    return result


def _neighbours(
    tracks: Tracks, short: NDArray[np.int64], usable: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Who is near each short track in the middle of its life: distances (S, N) and indices (S, N) of usable
    tracks; at infinite distances where there are fewer."""
    visible = tracks.visible[:, short]
    middle = np.argmax(np.cumsum(visible, axis=0) > visible.sum(axis=0) // 2, axis=0)
    distance = np.full((len(short), _NEIGHBOURS), np.inf)
    near = np.full(distance.shape, usable[0])
    for frame in np.unique(middle).tolist():
        there, asked = usable[tracks.visible[frame, usable]], middle == frame
        if len(there):
            tree = cKDTree(tracks.xy[frame, there])
            distance[asked], index = tree.query(tracks.xy[frame, short[asked]], k=_NEIGHBOURS)
            near[asked] = there[np.minimum(index, len(there) - 1)]
    return distance, near


def follow_all_round(tracks: Tracks, labels: NDArray[np.int64], unit: float) -> NDArray[np.int64]:
    """Labels of all tracks of a window, those seen in a single frame by what is all round them there.

    Their motion is not known: they take a label only where all of the nearest tracks agree on it, and an
    object's only where these do not all lie on one side: most of what lies beside an object is none of it.

    Parameters
    ----------
    labels : (P,) int
        Of the tracks; -1 undecided.
    unit : float
        Pixels per pixel of a 640x480 picture.
    """
    result = labels.copy()
    single = tracks.visible.sum(axis=0) == 1
    for frame in np.flatnonzero(tracks.visible[:, single].any(axis=1)).tolist():
        seen = tracks.visible[frame]
        asked, near = np.flatnonzero(seen & single), np.flatnonzero(seen & ~single & (labels != UNDECIDED))
        if len(near) < _ALL_ROUND:
            continue
        distance, index = cKDTree(tracks.xy[frame, near]).query(tracks.xy[frame, asked], k=_ALL_ROUND)
        votes = labels[near[index]]
        agreed = (np.ptp(votes, axis=1) == 0) & (np.max(distance, axis=1) <= _REACH * unit)
        beside = _in_one_quarter(tracks.xy[frame, near[index]] - tracks.xy[frame, asked, None])
        agreed &= ~beside | (votes[:, 0] == BACKGROUND)
        result[asked[agreed]] = votes[agreed, 0]
    return result


def _in_one_quarter(to_neighbours: NDArray[np.float64]) -> Bools:
    """Whether points see all their neighbours within a right angle, given the ways (N, K, 2) there."""
    angle = np.sort(np.arctan2(to_neighbours[..., 1], to_neighbours[..., 0]), axis=1)
    gap = np.diff(angle, axis=1, append=angle[:, :1] + 2 * np.pi)
    return np.asarray(gap.max(axis=1) > 1.5 * np.pi, bool)


def _votes(
    tracks: Tracks,
    short: NDArray[np.int64],
    distance: NDArray[np.float64],
    near: NDArray[np.int64],
    labels: NDArray[np.int64],
    unit: float,
) -> NDArray[np.int64]:
    """Labels (S,) of short tracks, by their neighbours (S, N): each votes, the more the nearer and the more
    alike it moves."""
    # Most live for a few frames: each of these by itself (L,), not all frames of the window.
    track, frame = np.nonzero(tracks.visible[:, short].T)
    first = np.searchsorted(track, np.arange(len(short)))
    # With the observations last (2, N, L) each path is one run through memory.
    planes, row = tracks.planes.reshape(2, -1), frame * tracks.points
    own, others = planes.take(row + short[track], axis=1), row + near[track].T
    both = tracks.visible.ravel().take(others)
    # Rigid neighbours keep their offset; perspective changes it in proportion to the way.
    slip = _extent(planes.take(others, axis=1) - own[:, None], both, first).T
    slip[np.add.reduceat(both, first, axis=1, dtype=np.int64).T < 2] = np.inf
    way = _extent(own, np.ones(len(frame), dtype=bool), first)
    least = slip.min(axis=1, keepdims=True)
    told = np.isfinite(least[:, 0])
    excess = np.full_like(slip, np.inf)
    excess[told] = (slip[told] - least[told]) / (0.4 * unit + 0.04 * way[told, None])
    weight = np.exp(-excess) / (10 * unit + distance)
    # An object's label is carried neither far nor to what moves otherwise: that is seldom a part of it.
    far = (distance > _REACH * unit) | (excess > 1)
    weight[(labels[near] > BACKGROUND) & far] = 0.0
    candidates = np.unique(labels[near])
    support = np.stack([np.where(labels[near] == c, weight, 0.0).sum(axis=1) for c in candidates], axis=1)
    return np.where(weight.any(axis=1), candidates[np.argmax(support, axis=1)], UNDECIDED)


def _extent(xy: NDArray[np.float64], seen: Bools, first: NDArray[np.int64]) -> NDArray[np.float64]:
    """Diagonal of the box (..., S) that each of the paths fills where it is seen; their places (2, ..., L)
    one path after the other, each from its ``first`` (S,) on."""
    low = np.minimum.reduceat(np.where(seen, xy, np.inf), first, axis=-1)
    high = np.maximum.reduceat(np.where(seen, xy, -np.inf), first, axis=-1)
    return np.asarray(np.linalg.norm(np.where(high >= low, high - low, 0.0), axis=0), np.float64)
