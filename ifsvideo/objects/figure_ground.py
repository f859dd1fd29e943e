"""Figure or ground: does the picture at the very point move with the object, or with the ground behind it?

KLT follows a window. Where the outline of an object crosses a line of the background, a corner is found a few
pixels outside the object; its window sees the outline and rides along, and by its motion the track cannot be
told from the object's own. The few pixels in the middle of the window can tell: on the object they look a few
frames later like those at the track's own place, on the ground like those where the ground has gone
meanwhile. What is covered or uncovered between the two frames looks like neither; but the outline covers on
one side only of the time at which the point is looked at, so both sides are asked and the better one counts.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

from ifsvideo.tracking.appearance import grid
from ifsvideo.tracking.tracker import shrunk, tracked_size
from ifsvideo.types import BACKGROUND, FramePoints, Image, Ints
from ifsvideo.video.picture import Picture

_LAGS_S = (0.07, 0.13, 0.2)
"""Seconds between the pictures that are compared: so few that neither object nor ground changes its looks,
several, so that in one of them the two have parted."""
_RADIUS = 1
"""Half side of the patch less half a pixel: 3x3 pixels, for points 2 px off the outline. As KLT's window it
is a fixed number of pixels of the picture that is tracked."""
_BLUR = 0.7
"""Standard deviation of the smoothing, pixels: takes out noise and the error of sampling between pixels."""
_PARTED = 2.0
"""Farther than this, pixels, object and ground must have parted; nearer, their patches overlap."""
_REACH = 44.0
"""Farthest that the ground's nearest track may be, pixels of a 640x480 picture: farther off the ground may
move otherwise, and where it has no texture there is nothing to compare."""
_NEIGHBOURS = 6
"""Tracks of the ground whose median motion is taken; even."""
_LEAST_GROUND = 8
"""Fewest tracks of the ground that two frames must share."""
_LEAST_ROWS = 3
"""Fewest observations by which a track is judged."""
_FEW_ROWS = 4.0
"""Observations at which half of the ratio above one is asked for: few tell that the ground fits better, not
that it fits as well."""
_NOISE = 1.0
"""Misfit, grey levels, that noise alone leaves: where neither side's is larger, nothing can be told. Added to
both, so that two small ones count as nearly equal."""


class _Seen:
    """A frame among the last few: its points, and the least misfit to either side so far."""

    def __init__(self, picture: Picture, points: FramePoints, labels: Ints, scale: float) -> None:
        self.points = points
        self.moving = labels > BACKGROUND
        self.ground = labels == BACKGROUND
        self.to_object = np.full(len(labels), np.inf, np.float32)
        self.to_ground = np.full(len(labels), np.inf, np.float32)
        self._picture = picture
        self._scale = scale

    @cached_property
    def looks(self) -> tuple[Image, NDArray[np.float64]]:
        """The picture as it is compared, and its pixels per pixel of the coordinates along x and y.

        Made when first asked for: where nothing moves, nobody does.
        """
        grey = self._picture.grey
        height, width = grey.shape
        small = shrunk(grey, *tracked_size(width, height, self._scale))
        scale = np.array(small.shape[::-1]) / grey.shape[::-1]
        return np.asarray(cv2.GaussianBlur(small, (0, 0), _BLUR), np.uint8), scale


class FigureGround:
    """Compares, frame by frame, what tracks called moving look like with what object and ground would show.

    Of the frames only the last few are kept, of every observation in them the least misfit to either side,
    and of every track the sums of these.

    Parameters
    ----------
    scale : float
        Share of the picture's size in which it was tracked.
    fps : float, optional
        Frames a second; 30 where nobody told.

    Examples
    --------
    ::

        check = FigureGround()
        for picture, points, labels in frames:
            check.add(picture, points, labels)
        off = np.isin(points.ids, check.on_ground(1.65))
    """

    def __init__(self, scale: float = 1.0, fps: float | None = None) -> None:
        self._scale = scale
        self.lags = tuple(sorted({max(1, round(lag * (fps or 30.0))) for lag in _LAGS_S}))
        """The same in frames."""
        self._recent: deque[_Seen] = deque(maxlen=self.lags[-1] + 1)
        self._ids = np.empty(0, np.int64)
        self._sums = np.empty((0, 3))
        """Of each of these tracks: rows, and the sums of the roots of their misfits to object and ground."""

    def add(self, picture: Picture, points: FramePoints, labels: Ints) -> None:
        """Take the next frame.

        Parameters
        ----------
        picture : Picture, in the size of the coordinates.
        points : FramePoints, ordered by id.
        labels : (N,) int
            0 background, 1, 2, ... moving.
        """
        if len(self._recent) == self._recent.maxlen:
            self._ids, self._sums = self._with_rows_of([self._recent[0]])
        self._recent.append(_Seen(picture, points, labels, self._scale))
        for lag in self.lags:
            if lag < len(self._recent):
                _compare(self._recent[-1 - lag], self._recent[-1])

    def on_ground(self, least_ratio: float) -> NDArray[np.int64]:
        """Tracks (T,), ordered, that were called moving but show the ground.

        A track is judged by the mean over its rows so far of the square root of the misfits: rows in which
        both sides are covered count little then. It shows the ground unless the ground fits ``least_ratio``
        times worse than the object. Where nothing can be told, it is not among them: it was compared too
        seldom, or is so plain that both sides fit.
        """
        ids, sums = self._with_rows_of(list(self._recent))
        rows = sums[:, 0]
        to_object, to_ground = np.square(sums[:, 1:] / np.maximum(rows, 1)[:, None]).T
        can_tell = (rows >= _LEAST_ROWS) & (np.maximum(to_object, to_ground) > _NOISE)
        ratio = 1 + (least_ratio - 1) * rows / (rows + _FEW_ROWS)
        shows_ground = can_tell & (to_ground + _NOISE < ratio * (to_object + _NOISE))
        return np.asarray(ids[shows_ground], np.int64)

    def forget(self, gone: NDArray[np.int64]) -> None:
        """Drop what is known of some tracks (T,) that have ended; one that comes again is a new one."""
        kept = ~np.isin(self._ids, gone, assume_unique=True)
        self._ids, self._sums = self._ids[kept], self._sums[kept]

    def _with_rows_of(self, frames: Sequence[_Seen]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Tracks and their sums, with what these frames tell of them."""
        ids, sums = [self._ids], [self._sums]
        for frame in frames:
            judged = np.isfinite(frame.to_object)
            roots = np.sqrt([frame.to_object[judged], frame.to_ground[judged]])
            ids.append(frame.points.ids[judged])
            sums.append(np.vstack([np.ones(roots.shape[1]), roots]).T)
        names, track = np.unique(np.concatenate(ids), return_inverse=True)
        total = np.zeros((len(names), 3))
        np.add.at(total, track, np.concatenate(sums))
        return names, total


def _compare(one: _Seen, other: _Seen) -> None:
    """Misfits of the moving points of either frame, by what the other shows."""
    if not (one.moving.any() or other.moving.any()):
        return
    place = np.searchsorted(other.points.ids, one.points.ids)
    row = np.flatnonzero(np.append(other.points.ids, -1)[place] == one.points.ids)
    _judge(one, other, row, place[row])
    _judge(other, one, place[row], row)


def _judge(here: _Seen, there: _Seen, row: NDArray[np.intp], other: NDArray[np.intp]) -> None:
    """Misfits of the moving points of frame ``here``, by what frame ``there`` shows; the tracks that both see
    stand at ``row`` here and at ``other`` there."""
    ground, moving = here.ground[row], here.moving[row]
    if np.count_nonzero(ground) < _LEAST_GROUND or not moving.any():
        return
    before, scale = here.looks
    after, _ = there.looks
    a = (here.points.xy[row] + 0.5) * scale - 0.5
    b = (there.points.xy[other] + 0.5) * scale - 0.5
    reach = _REACH * math.hypot(*before.shape) / 800
    distance, nearest = cKDTree(a[ground], compact_nodes=False, balanced_tree=False).query(
        a[moving], k=_NEIGHBOURS
    )
    # The median of an even number; numpy's own spends most of its time on checks.
    middle = np.sort((b - a)[ground][nearest], axis=1)[:, _NEIGHBOURS // 2 - 1 : _NEIGHBOURS // 2 + 1]
    with_ground = a[moving] + middle.mean(axis=1)
    parted = np.linalg.norm(with_ground - b[moving], axis=1) > _PARTED
    asked = parted & (np.asarray(distance)[:, 0] <= reach)
    rows = row[moving][asked]
    looks = _patches(before, a[moving][asked])
    for least, place in ((here.to_object, b[moving]), (here.to_ground, with_ground)):
        misfit = np.abs(_patches(after, place[asked]) - looks).mean(axis=1)
        least[rows] = np.minimum(least[rows], misfit)


def _patches(picture: Image, xy: NDArray[np.float64]) -> NDArray[np.float32]:
    """Pixels (N, 9) round points (N, 2), bilinear between pixels; beyond the border that goes on."""
    x, y = grid(_RADIUS)
    # Not cv2.remap: it takes 32766 points at most, and a tracker of one's own may give more.
    places = [xy[:, 1:] + y, xy[:, :1] + x]
    return np.asarray(map_coordinates(picture, places, np.float32, order=1, mode="nearest"))
