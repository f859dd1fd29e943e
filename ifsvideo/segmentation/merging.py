"""Stage 5 as the thesis has it: segments merge unless shear parts them (thesis 3.1, Algorithms 2 and 3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation import shear
from ifsvideo.segmentation.refinement import delaunay_edges
from ifsvideo.types import Tracks

_UNKNOWN, _SAME, _APART = 0, 1, -1


def merge_by_shear(
    tracks: Tracks,
    segments: NDArray[np.int64],
    anchor: NDArray[np.float64],
    pairs: int,
    ratio: float,
    unit: float,
) -> tuple[NDArray[np.int64], dict[tuple[int, int], float]]:
    """Decide every pair of segments, nearest centroids first, neighbours before others; relations are
    transitive.

    Parameters
    ----------
    segments : (P,) int
        Segment of every point, 0, 1, ... without gaps.
    anchor : (P, 2) float
        Where the points lie in the base frame, pixels.
    pairs, ratio : see `SegmenterConfig.pairs`, `SegmenterConfig.shear_ratio`.
    unit : float
        Pixels per configured pixel: stretch is counted in pixels of a 640x480 picture.

    Returns
    -------
    groups : (P,) int
        Group of every point, 0, 1, ...
    scores : dict
        For each pair that was tested, shear between over mean shear inside.
    """
    count = int(segments.max()) + 1
    scaled = Tracks(tracks.xy / unit, tracks.visible, tracks.ids)
    anchor = anchor / unit
    members = [np.flatnonzero(segments == s) for s in range(count)]
    inside = [shear.score(scaled, shear.inside_edges(anchor, m)) for m in members]
    # A segment of a single point has no inside; the typical one stands in.
    typical = float(np.nanmedian(inside)) if np.isfinite(inside).any() else 0.0
    inside = [s if np.isfinite(s) else typical for s in inside]

    centroid = np.array([anchor[m].mean(axis=0) for m in members])
    distance = np.linalg.norm(centroid[:, None] - centroid[None], axis=2)
    across = segments[delaunay_edges(anchor)]
    neighbours = np.zeros((count, count), dtype=bool)
    neighbours[across[:, 0], across[:, 1]] = neighbours[across[:, 1], across[:, 0]] = True
    order = sorted(
        ((i, j) for i in range(count) for j in range(i + 1, count)),
        key=lambda pair: (not neighbours[pair], distance[pair], pair),
    )

    relation = np.where(np.eye(count, dtype=bool), _SAME, _UNKNOWN)
    scores: dict[tuple[int, int], float] = {}
    for i, j in order:
        if relation[i, j] != _UNKNOWN:
            continue
        between = shear.score(scaled, shear.between_edges(anchor, members[i], members[j], pairs))
        scores[i, j] = between / max((inside[i] + inside[j]) / 2, 1e-12)
        # Segments that were never seen together are not known to move alike.
        same = scores[i, j] <= ratio
        _record(relation, i, j, _SAME if same else _APART)
    group = np.array([int(np.flatnonzero(row == _SAME)[0]) for row in relation])
    return np.unique(group, return_inverse=True)[1][segments].astype(np.int64), scores


def _record(relation: NDArray[np.int64], i: int, j: int, value: int) -> None:
    """Write down a decision and what follows from it: a~b and b~c give a~c, a~b and a!~c give b!~c."""
    like_i, like_j = relation[i] == _SAME, relation[j] == _SAME
    relation[np.ix_(like_i, like_j)] = value
    relation[np.ix_(like_j, like_i)] = value
    if value == _SAME:
        apart = (relation[i] == _APART) | (relation[j] == _APART)
        both = like_i | like_j
        relation[np.ix_(both, apart)] = _APART
        relation[np.ix_(apart, both)] = _APART
