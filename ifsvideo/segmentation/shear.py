"""In-frame shear and stretch, the measure of the thesis (3.1, Algorithm 2)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from ifsvideo.segmentation.refinement import delaunay_edges
from ifsvideo.types import Tracks


def shear_and_stretch(
    tracks: Tracks, edges: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Change of orientation (radians) and of length (pixels) of edges between consecutive frames.

    Parameters
    ----------
    edges : (E, 2) int
        Pairs of points.

    Returns
    -------
    shear, stretch : (F-1, E) float
        Absolute changes; NaN where an end is not seen in both frames.
    """
    start, end = edges.T
    x, y = tracks.planes.take(end, axis=2) - tracks.planes.take(start, axis=2)
    cross = x[:-1] * y[1:] - y[:-1] * x[1:]
    shear = np.abs(np.arctan2(cross, x[:-1] * x[1:] + y[:-1] * y[1:]))
    return shear, np.abs(np.diff(np.sqrt(x * x + y * y), axis=0))


def totals(tracks: Tracks, edges: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Shear plus stretch of each edge (E,), summed over the frames in which it was seen, and their number
    (E,)."""
    both = np.add(*shear_and_stretch(tracks, edges))
    seen = np.isfinite(both)
    return np.where(seen, both, 0.0).sum(axis=0), seen.sum(axis=0)


def score(tracks: Tracks, edges: NDArray[np.int64]) -> float:
    """Mean over edges (E, 2) and frames of shear plus stretch (Algorithm 2); NaN where no edge was ever
    measured."""
    return float(scores(tracks, [edges])[0])


def scores(tracks: Tracks, sets: Sequence[NDArray[np.int64]]) -> NDArray[np.float64]:
    """The same of each of some sets of edges, in one go."""
    found = np.full(len(sets), np.nan)
    some = [number for number, edges in enumerate(sets) if len(edges)]
    if some:
        every = [sets[number] for number in some]
        first = np.cumsum([0, *map(len, every[:-1])])
        total, seen = (np.add.reduceat(part, first) for part in totals(tracks, np.concatenate(every)))
        np.divide(total, seen, out=total, where=seen > 0)
        found[some] = np.where(seen > 0, total, np.nan)
    return found


def inside_edges(anchor: NDArray[np.float64], members: NDArray[np.int64]) -> NDArray[np.int64]:
    """Delaunay edges of a segment's own points: indices of points (E, 2)."""
    return members[delaunay_edges(anchor[members])]


def between_edges(
    anchor: NDArray[np.float64], first: NDArray[np.int64], second: NDArray[np.int64], pairs: int
) -> NDArray[np.int64]:
    """Greedy one-to-one assignment of the ``pairs`` nearest points of two segments.

    Returns
    -------
    (E, 2) int
        Indices of points, nearest first.
    """
    left = cdist(anchor[first], anchor[second])
    rows: list[int] = []
    columns: list[int] = []
    for _ in range(min(pairs, len(first), len(second))):
        i, j = divmod(int(left.argmin()), len(second))
        rows.append(i)
        columns.append(j)
        left[i] = np.inf
        left[:, j] = np.inf
    chosen = np.empty((len(rows), 2), dtype=np.int64)
    chosen[:, 0], chosen[:, 1] = first[rows], second[columns]
    return chosen
