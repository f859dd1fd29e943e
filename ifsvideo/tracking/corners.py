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
    """New corners where the picture has room for them.

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
        Pixels; M <= max_points - N, by growing crowdedness of the cell, then by falling strength.
    """
    height, width = grey.shape
    room = config.max_points - len(taken)
    if room <= 0:
        return np.empty((0, 2), np.float32)
    diagonal = math.hypot(width, height)
    distance = max(2, round(config.min_distance * diagonal))
    strength = cv2.cornerMinEigenVal(grey, 5, ksize=3)
    free = allowed & ~_surroundings(taken, grey.shape, distance)
    # A maximum of its whole neighbourhood, so that corners keep their distance without a greedy search.
    kernel = np.ones((2 * distance + 1, 2 * distance + 1), np.uint8)
    peaks = (strength >= cv2.dilate(np.where(free, strength, 0), kernel)) & free
    peaks &= strength >= (config.min_contrast / SOBEL_GAIN) ** 2
    y, x = np.nonzero(peaks)
    xy = np.stack([x, y], axis=1).astype(np.float32)
    found = np.asarray(strength[y, x], np.float32)

    grid = Grid.cover(width, height, config.cells)
    cell = grid.cell_of(xy)
    best = np.zeros(grid.cells, np.float32)
    np.maximum.at(best, cell, found)
    good = found >= config.quality * best[cell]
    xy, found, cell = xy[good], found[good], cell[good]

    crowd = np.bincount(grid.cell_of(taken), minlength=grid.cells).astype(np.int64)[cell]
    crowd += _rank_within(cell, found)
    order = np.lexsort((-found, crowd))
    order = order[crowd[order] < config.crowding * config.max_points / grid.cells]
    return _apart(xy[order], distance)[:room]


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
