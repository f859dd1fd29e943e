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

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

from ifsvideo.tracking.appearance import grid
from ifsvideo.tracking.tracker import LARGEST
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import BACKGROUND, Bools, Image

_LAGS = (2, 4, 6)
"""Frames between the pictures that are compared: few enough that neither object nor ground changes its looks,
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
"""Tracks of the ground whose median motion is taken."""
_LEAST_GROUND = 8
"""Fewest tracks of the ground that two frames must share."""
_LEAST_ROWS = 3
"""Fewest observations by which a track is judged."""
_NOISE = 1.0
"""Misfit, grey levels, that noise alone leaves: where neither side's is larger, nothing can be told. Added to
both, so that two small ones count as nearly equal."""


class FigureGround:
    """Compares, frame by frame, what tracks called moving look like with what object and ground would show.

    Of the frames only the last few are kept, and of every observation the least misfit to either side.

    Parameters
    ----------
    points : Trajectories
    labels : (N,) int
        Label of every row of the trajectories: 0 background, 1, 2, ... moving.

    Examples
    --------
    ::

        check = FigureGround(points, labels)
        for grey in frames:
            check.add(grey)
        labels[check.on_ground(1.65)] = 0
    """

    def __init__(self, points: Trajectories, labels: NDArray[np.int32]) -> None:
        self._points = points
        self._bounds = np.searchsorted(points.frame, np.arange(points.frames + 1, dtype=np.int32))
        self._moving = labels > BACKGROUND
        self._ground = labels == BACKGROUND
        self._frame = 0
        self._pictures: deque[Image] = deque(maxlen=max(_LAGS) + 1)
        self._to_object = np.full(len(labels), np.inf, np.float32)
        self._to_ground = np.full(len(labels), np.inf, np.float32)

    def add(self, grey: Image) -> None:
        """Take the next frame, (H, W) uint8, in the size of the coordinates."""
        small = _as_tracked(grey)
        scale = np.array(small.shape[::-1]) / grey.shape[::-1]
        reach = _REACH * math.hypot(*small.shape) / 800
        self._pictures.append(np.asarray(cv2.GaussianBlur(small, (0, 0), _BLUR), np.uint8))
        for lag in _LAGS:
            if lag < len(self._pictures):
                earlier = self._frame - lag
                self._compare(earlier, self._frame, scale, reach)
                self._compare(self._frame, earlier, scale, reach)
        self._frame += 1

    def on_ground(self, least_ratio: float) -> Bools:
        """Rows (N,) that are called moving but whose track shows the ground.

        A track is judged as a whole, by the mean over its rows of the square root of the misfits: rows in
        which both sides are covered count little then. It shows the ground unless the ground fits
        ``least_ratio`` times worse than the object. Where nothing can be told, the track keeps its label: it
        was compared too seldom, or is so plain that both sides fit.
        """
        judged = np.isfinite(self._to_object)
        names, track = np.unique(self._points.ids, return_inverse=True)
        rows = np.bincount(track[judged], minlength=len(names))

        def misfit(of_rows: NDArray[np.float32]) -> NDArray[np.float64]:
            total = np.bincount(track[judged], np.sqrt(of_rows[judged]), len(names))
            return np.square(total / np.maximum(rows, 1))

        to_object, to_ground = misfit(self._to_object), misfit(self._to_ground)
        can_tell = (rows >= _LEAST_ROWS) & (np.maximum(to_object, to_ground) > _NOISE)
        shows_ground = can_tell & (to_ground + _NOISE < least_ratio * (to_object + _NOISE))
        return np.asarray(self._moving & shows_ground[track], bool)

    def _compare(self, here: int, there: int, scale: NDArray[np.float64], reach: float) -> None:
        """Misfits of the moving rows of frame ``here``, by what frame ``there`` shows."""
        row, other = self._seen_in_both(here, there)
        ground, moving = self._ground[row], self._moving[row]
        if np.count_nonzero(ground) < _LEAST_GROUND or not moving.any():
            return
        a, b = ((self._points.xy[rows] + 0.5) * scale - 0.5 for rows in (row, other))
        distance, nearest = cKDTree(a[ground]).query(a[moving], k=_NEIGHBOURS)
        with_ground = a[moving] + np.median((b - a)[ground][nearest], axis=1)
        parted = np.linalg.norm(with_ground - b[moving], axis=1) > _PARTED
        asked = parted & (np.asarray(distance)[:, 0] <= reach)
        rows = row[moving][asked]
        before, after = (self._pictures[frame - self._frame - 1] for frame in (here, there))
        looks = _patches(before, a[moving][asked])
        for least, place in ((self._to_object, b[moving]), (self._to_ground, with_ground)):
            misfit = np.abs(_patches(after, place[asked]) - looks).mean(axis=1)
            least[rows] = np.minimum(least[rows], misfit)

    def _seen_in_both(self, here: int, there: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rows of the tracks seen in two frames, in each of them."""
        a, b = (slice(*self._bounds[frame : frame + 2]) for frame in (here, there))
        ids = self._points.ids
        _, row, other = np.intersect1d(ids[a], ids[b], assume_unique=True, return_indices=True)
        return a.start + row, b.start + other


def _as_tracked(grey: Image) -> Image:
    """The picture in the size in which the tracker looks at it."""
    halvings = max(0, math.ceil(math.log2(math.hypot(*grey.shape) / LARGEST)))
    height, width = (max(1, side >> halvings) for side in grey.shape)
    return np.asarray(cv2.resize(grey, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def _patches(picture: Image, xy: NDArray[np.float64]) -> NDArray[np.float32]:
    """Pixels (N, 9) round points (N, 2), bilinear between pixels; beyond the border that goes on."""
    x, y = grid(_RADIUS)
    # Not cv2.remap: it takes 32766 points at most, and a tracker of one's own may give more.
    places = [xy[:, 1:] + y, xy[:, :1] + x]
    return np.asarray(map_coordinates(picture, places, np.float32, order=1, mode="nearest"))
