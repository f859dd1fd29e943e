"""Pyramidal Lucas-Kanade, forward and back (Bouguet 2000; Kalal, Mikolajczyk and Matas, ICPR 2010)."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import Bools, Image

STOP = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.01)
"""OpenCV's own: 30 steps, or a step below 0.01 px."""
MIN_WINDOW = 9
"""Least height of the window, pixels: fewer pixels do not fix a displacement against noise."""
LANES = 8
"""Pixels of a row that OpenCV computes at once. What is left of a row it takes one by one: a window 11 pixels
wide takes far longer than one of 8 (`ifsvideo/benchmark/TRIED.md`)."""
MAX_LEVELS = 4
"""Most levels above the picture itself; on a coarser one, neighbours blend into the window."""
FLAT_RADIUS = 8
"""Half side, pixels, of the neighbourhood against which `flatten` measures; about the KLT window."""
FLAT_CONTRAST = 48.0
"""Grey levels that one standard deviation of the neighbourhood becomes."""
FLAT_NOISE = 3.0
"""Standard deviation, grey levels, that is taken for noise and not stretched."""


class Search(NamedTuple):
    """How far and how finely KLT looks.

    Attributes
    ----------
    window : int
        Height of the window, pixels, odd.
    levels : int
        Levels of the pyramid above the picture itself.
    """

    window: int
    levels: int

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the window: as wide as high, but for whole `LANES`."""
        return LANES * max(1, round(self.window / LANES)), self.window

    @classmethod
    def for_picture(cls, width: int, height: int, window: int) -> Search:
        """The given window and 3 levels at 640x360; both shrink with the picture, so that the window still
        fits the coarsest level, and larger pictures get one level more."""
        side = min(width, height)
        fitting = min(window, max(MIN_WINDOW, side // 12 | 1))
        levels = math.floor(math.log2(max(1.0, side / fitting))) - 1
        return cls(fitting, min(max(levels, 0), MAX_LEVELS))


class Steps(NamedTuple):
    """Where points went.

    Attributes
    ----------
    xy : (N, 2) float32
        Position in the later picture, pixels.
    return_error : (N,) float32
        Distance between a point and itself tracked forward and back, pixels; infinite where KLT gave up.
    """

    xy: NDArray[np.float32]
    return_error: NDArray[np.float32]


def follow(before: Image, after: Image, xy: NDArray[np.float32], search: Search) -> Steps:
    """Track points (N, 2) from one grey picture (H, W) uint8 to the next, and back as a check.

    The way back starts from the point found, not from the point known: else it would agree too easily.
    """
    if len(xy) == 0:
        return Steps(np.empty((0, 2), np.float32), np.empty(0, np.float32))
    there, found = _flow(before, after, xy, search)
    back, found_back = _flow(after, before, there, search)
    error = np.hypot(*(back - xy).T)
    return Steps(there, np.where(found & found_back & np.isfinite(error), error, np.inf).astype(np.float32))


def _flow(
    before: Image, after: Image, xy: NDArray[np.float32], search: Search
) -> tuple[NDArray[np.float32], Bools]:
    points = xy.reshape(-1, 1, 2)
    moved, found, _ = cv2.calcOpticalFlowPyrLK(
        before,
        after,
        points,
        points.copy(),
        winSize=search.size,
        maxLevel=search.levels,
        criteria=STOP,
        flags=cv2.OPTFLOW_LK_GET_MIN_EIGENVALS,  # at hand; the error told otherwise takes time, unread
    )
    return np.asarray(moved, np.float32).reshape(-1, 2), np.asarray(found).ravel() == 1


def flatten(grey: Image) -> Image:
    """The picture without local brightness and contrast, (H, W) uint8: for KLT across a jump of exposure."""
    side = 2 * FLAT_RADIUS + 1
    values = grey.astype(np.float32)
    mean = cv2.boxFilter(values, -1, (side, side))
    variance = cv2.boxFilter(values * values, -1, (side, side)) - mean * mean
    scale = FLAT_CONTRAST / np.sqrt(np.maximum(variance, 0) + FLAT_NOISE**2)
    return np.clip((values - mean) * scale + 128, 0, 255).astype(np.uint8)
