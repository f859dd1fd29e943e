"""Shi-Tomasi corners spread over the picture (Shi and Tomasi, Good Features to Track, CVPR 1994)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ifsvideo.config import TrackerConfig
from ifsvideo.types import Bools, Floats, Image

SOBEL_GAIN = 255.0 / 2.0
"""Back to grey levels per pixel: cv2.cornerMinEigenVal divides a 3x3 Sobel response (8 times the gradient) by
4 x 255 before it squares."""

NEEDY = 0.5
"""Share of its fair share of points below which a cell gets some even at the cost of others."""
LARGEST = 1150.0
"""Greatest diagonal that is searched in full, pixels (960x540 is); larger pictures are halved. There the
corners' neighbourhood, 5 pixels, is then about as large as KLT's window, and the search takes a tenth of the
time. The least contrast holds in the picture that is searched."""
ROUNDS = 4
"""Rounds of suppression; on real pictures the first finds about half the corners that fit, the fourth few."""


@dataclass(frozen=True)
class Grid:
    """Cells of about equal sides that cover a picture.

    Attributes
    ----------
    columns, rows : int
    width, height : int
        Size of the picture, pixels.
    """

    columns: int
    rows: int
    width: int
    height: int

    @classmethod
    def cover(cls, width: int, height: int, cells: int) -> Grid:
        """About ``cells`` nearly square cells."""
        side = math.sqrt(width * height / cells)
        return cls(max(1, round(width / side)), max(1, round(height / side)), width, height)

    @property
    def cells(self) -> int:
        """Number of cells."""
        return self.columns * self.rows

    def cell_of(self, xy: NDArray[np.float32]) -> NDArray[np.int64]:
        """Number of the cell in which each point (N, 2) lies."""
        column = np.clip((xy[:, 0] + 0.5) * self.columns / self.width, 0, self.columns - 1).astype(np.int64)
        row = np.clip((xy[:, 1] + 0.5) * self.rows / self.height, 0, self.rows - 1).astype(np.int64)
        return row * self.columns + column


def find_corners(
    grey: Image, taken: NDArray[np.float32], allowed: Bools, config: TrackerConfig
) -> NDArray[np.float32]:
    """New corners where the picture has room for them, and beyond that in cells that are all but empty.

    A corner is a local maximum of the smaller eigenvalue of the gradients' second moments, as strong as a
    share of the strongest of its own cell, and stronger than noise. The emptiest cells are served first.

    Whole pixels, and those of half a large picture, are exact enough: where a track is born is a choice, not
    a measurement. cv2.cornerSubPix would pull points from texture to the nearest crossing of lines, off the
    maximum that makes them good to track.

    Parameters
    ----------
    grey : (H, W) uint8
    taken : (N, 2) float32
        The points that are alive, pixels.
    allowed : (H, W) bool
        Where a corner may be.
    config : TrackerConfig

    Returns
    -------
    (M, 2) float32
        Pixels, by growing crowdedness of the cell, then by falling strength. More than max_points - N only
        where cells hold less than `NEEDY` of their fair share: what comes into view there must get points.
    """
    height, width = grey.shape
    room = config.max_points - len(taken)
    xy, found = _candidates(grey, taken, allowed, config)

    grid = Grid.cover(width, height, config.cells)
    cell = grid.cell_of(xy)
    best = np.zeros(grid.cells, np.float32)
    np.maximum.at(best, cell, found)
    good = found >= config.quality * best[cell]
    xy, found, cell = xy[good], found[good], cell[good]

    crowd = np.bincount(grid.cell_of(taken), minlength=grid.cells).astype(np.int64)[cell]
    crowd += _rank_within(cell, found)
    order = np.lexsort((-found, crowd))
    share = config.max_points / grid.cells
    order = order[crowd[order] < config.crowding * share]
    # With less than one point a cell there is no fair share, and points would only chase each other away.
    urgent = int(np.count_nonzero(crowd[order] < NEEDY * share)) if share >= 1 else 0
    return xy[order][: max(0, room, urgent)]


def _candidates(
    grey: Image, taken: NDArray[np.float32], allowed: Bools, config: TrackerConfig
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Corners (N, 2) that are strong enough and off each other and those that are taken; their strengths."""
    height, width = grey.shape
    diagonal = math.hypot(width, height)
    shrink = 2 if diagonal > LARGEST else 1
    size = (width // shrink, height // shrink)
    distance = max(2, round(config.min_distance * diagonal / shrink))
    searched = grey if shrink == 1 else cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    looked_at = allowed[::shrink, ::shrink][: size[1], : size[0]].astype(np.uint8)
    strength = np.asarray(cv2.cornerMinEigenVal(searched, 5, ksize=3), np.float32)
    strong = cv2.inRange(strength, (config.min_contrast / SOBEL_GAIN) ** 2, math.inf)
    off = _off((taken + 0.5) / shrink - 0.5, (size[1], size[0]), distance)
    free = np.asarray(cv2.bitwise_and(strong, off, mask=looked_at), np.uint8)
    xy = _peaks(strength, free, distance, config.max_points - len(taken))
    found = strength[tuple(xy.T[::-1].astype(np.int64))]
    return np.asarray((xy + 0.5) * shrink - 0.5, np.float32), np.asarray(found, np.float32)


def most_crowded(
    xy: NDArray[np.float32], width: int, height: int, number: int, cells: int
) -> NDArray[np.int64]:
    """Indices of the points (N, 2) to give up when ``number`` must go: the last of the fullest cells."""
    cell = Grid.cover(width, height, cells).cell_of(xy)
    rank = _rank_within(cell, -np.arange(len(xy), dtype=np.float32))
    return np.argsort(-rank, kind="stable")[:number]


def _peaks(strength: NDArray[np.float32], free: Image, distance: int, enough: int) -> NDArray[np.float32]:
    """Maxima (N, 2) of their whole neighbourhood, then those of what these leave free, until enough.

    The same as taking the strongest pixel left again and again, for all places at once. ``free`` (H, W) is
    255 where a maximum may be, else 0.
    """
    kernel = np.ones((2 * distance + 1, 2 * distance + 1), np.uint8)
    found = [np.empty((0, 2), np.float32)]
    left = cv2.bitwise_and(strength, strength, mask=free)
    for _ in range(ROUNDS):
        highest = cv2.compare(left, cv2.dilate(left, kernel), cv2.CMP_GE)
        xy = cv2.findNonZero(cv2.bitwise_and(highest, free))
        if xy is None:
            break
        found.append(_apart(xy.reshape(-1, 2).astype(np.float32), distance))
        if sum(map(len, found)) >= enough:
            break
        free = np.asarray(cv2.bitwise_and(free, _off(found[-1], free.shape, distance)), np.uint8)
        left = cv2.bitwise_and(left, left, mask=free)
    return np.concatenate(found)


def _off(points: Floats, shape: tuple[int, ...], distance: int) -> Image:
    """255 in the pixels (H, W) that are farther than ``distance`` from every point, along x or y, else 0."""
    height, width = shape
    mask = np.full((height, width), 255, np.uint8)
    column, row = np.rint(points).astype(np.int64).T
    mask[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)] = 0
    return np.asarray(cv2.erode(mask, np.ones((2 * distance + 1, 2 * distance + 1), np.uint8)), np.uint8)


def _rank_within(group: NDArray[np.int64], value: NDArray[np.float32]) -> NDArray[np.int64]:
    """Place of each element within its group, by falling value, from 0."""
    order = np.lexsort((-value, group))
    starts = np.searchsorted(group[order], group[order])
    rank = np.empty(len(group), np.int64)
    rank[order] = np.arange(len(group)) - starts
    return rank


def _apart(xy: NDArray[np.float32], distance: float) -> NDArray[np.float32]:
    """Without the later one of each pair within ``distance``: maxima of equal strength may be neighbours."""
    if len(xy) < 2:
        return xy
    pairs = cKDTree(xy).query_pairs(distance, output_type="ndarray")
    keep = np.ones(len(xy), bool)
    keep[pairs.max(axis=1)] = False
    return xy[keep]
