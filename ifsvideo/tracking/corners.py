"""Shi-Tomasi corners spread over the picture (Shi and Tomasi, Good Features to Track, CVPR 1994)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ifsvideo.config import TrackerConfig
from ifsvideo.types import Bools, Image

SOBEL_GAIN = 255.0 / 2.0
"""Back to grey levels per pixel: cv2.cornerMinEigenVal divides a 3x3 Sobel response (8 times the gradient) by
4 x 255 before it squares."""

NEEDY = 0.5
"""Share of its fair share of points below which a cell gets some even at the cost of others."""
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

    Whole pixels are exact enough: where a track is born is a choice, not a measurement. cv2.cornerSubPix
    would pull points from texture to the nearest crossing of lines, off the maximum that makes them good
    to track.

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
    diagonal = math.hypot(width, height)
    distance = max(2, round(config.min_distance * diagonal))
    strength = cv2.cornerMinEigenVal(grey, 5, ksize=3)
    strong = strength >= (config.min_contrast / SOBEL_GAIN) ** 2
    free = allowed & strong & ~_surroundings(taken, grey.shape, distance)
    xy = _peaks(np.asarray(strength, np.float32), free, distance, room)
    found = np.asarray(strength[tuple(xy.T[::-1].astype(np.int64))], np.float32)

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


def most_crowded(
    xy: NDArray[np.float32], width: int, height: int, number: int, cells: int
) -> NDArray[np.int64]:
    """Indices of the points (N, 2) to give up when ``number`` must go: the last of the fullest cells."""
    cell = Grid.cover(width, height, cells).cell_of(xy)
    rank = _rank_within(cell, -np.arange(len(xy), dtype=np.float32))
    return np.argsort(-rank, kind="stable")[:number]


def _peaks(strength: NDArray[np.float32], free: Bools, distance: int, enough: int) -> NDArray[np.float32]:
    """Maxima (N, 2) of their whole neighbourhood, then those of what these leave free, until enough.

    The same as taking the strongest pixel left again and again, for all places at once.
    """
    kernel = np.ones((2 * distance + 1, 2 * distance + 1), np.uint8)
    found = [np.empty((0, 2), np.float32)]
    for _ in range(ROUNDS):
        open_strength = np.where(free, strength, 0)
        y, x = np.nonzero((open_strength >= cv2.dilate(open_strength, kernel)) & free)
        if len(x) == 0:
            break
        found.append(_apart(np.stack([x, y], axis=1).astype(np.float32), distance))
        if sum(map(len, found)) >= enough:
            break
        free = free & ~_surroundings(found[-1], free.shape, distance)
    return np.concatenate(found)


def _surroundings(points: NDArray[np.float32], shape: tuple[int, ...], distance: int) -> Bools:
    """Mask (H, W) of the pixels within ``distance`` of a point, along x and along y."""
    height, width = shape
    mask = np.zeros((height, width), np.uint8)
    column, row = np.rint(points).astype(np.int64).T
    mask[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)] = 1
    return cv2.dilate(mask, np.ones((2 * distance + 1, 2 * distance + 1), np.uint8)).astype(bool)


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
