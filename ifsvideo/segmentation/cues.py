"""What stage 5 knows of two segments: the measurements by which they are told to be one motion or two.

All are logarithms, so that a linear rule weighs ratios: twice the shear, half the gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation import shear
from ifsvideo.segmentation.lowrank import Subspace, trajectory_matrix
from ifsvideo.types import Tracks

Array = NDArray[np.float64]
Members = NDArray[np.int64]

CUES = ("rigid", "affine", "shear", "shear_ratio", "gap", "larger", "smaller")
"""Names of what is measured between two segments, in the order of the columns of `Cues.between`:

rigid, affine : how far the smaller one's points are from the larger one's rank-3 and rank-2 subspace, over
    what is usual inside segments (cross prediction; perspective fails it, too, over deep scenes)
shear : in-frame shear and stretch between nearest points, a frame (thesis Algorithm 2)
shear_ratio : the same over that inside the two (the thesis's predicate)
gap : least distance between their points
larger, smaller : their numbers of points
"""

_MOST = 60
"""Points by which a segment is measured; more tell nothing new."""
_KEY_FRAMES = 12
"""Frames in which subspaces are fitted: a motion is smooth, and more would cost time and tell little."""
_LEAST_FOR_NOISE = 6
"""Points that a segment needs to tell how noisy tracks are; fewer fit any subspace."""
_LEAST_NOISE = 0.05
"""Pixels; no tracker is better."""


@dataclass(frozen=True)
class Group:
    """A segment, or several that were merged.

    Attributes
    ----------
    members : (n,) int, indices of points
    reliable : (n',) int, those of them that their segment's model explains
    sample : (n'',) int, those of them that are measured
    evidence : float
        Median distance of the reliable points from a static point's way; above 1 speaks for motion.
    inside : float, shear inside it, NaN where it has no edge
    rigid, affine : (P,) float, distance of every point from its rank-3 and rank-2 subspace, pixels
    """

    members: Members
    reliable: Members
    sample: Members
    evidence: float
    inside: float
    rigid: Array
    affine: Array


class Cues:
    """The measurements of one window.

    Parameters
    ----------
    tracks : Tracks
    anchor : (P, 2) float, places in the base frame, pixels
    evidence : (P,) float
        Distance from a static point's way in units of what is usual in this window.
    unit : float, pixels of a picture per pixel of a 640x480 one
    pairs : int
        Pairs of points between which shear is measured.
    """

    def __init__(self, tracks: Tracks, anchor: Array, evidence: Array, unit: float, pairs: int) -> None:
        self.tracks, self.anchor, self.evidence, self.unit, self.pairs = tracks, anchor, evidence, unit, pairs
        self.W, self.seen = trajectory_matrix(tracks, _KEY_FRAMES)
        self.noise = self.typical_inside = 0.0

    def groups(self, segments: list[tuple[Members, Members]]) -> list[Group]:
        """Groups of the segments that a window starts with: (members, reliable) each."""
        found = [self.group(members, reliable) for members, reliable in segments]
        own = [np.median(g.rigid[g.sample]) for g in found if len(g.sample) >= _LEAST_FOR_NOISE]
        self.noise = max(float(np.median(own)) if own else 0.0, _LEAST_NOISE * self.unit)
        insides = [g.inside for g in found if np.isfinite(g.inside)]
        self.typical_inside = float(np.median(insides)) if insides else 0.0
        return found

    def group(self, members: Members, reliable: Members) -> Group:
        """Measure a group by itself."""
        sample = reliable[:: 1 + (len(reliable) - 1) // _MOST]
        W, seen = self.W[:, sample], self.seen[:, sample]
        space = Subspace.fit(W, seen, 3)
        rigid, affine = (each.distance(self.W, self.seen) for each in (space, space.main(W, seen, 2)))
        inside = shear.score(self.tracks, shear.inside_edges(self.anchor, sample))
        return Group(members, reliable, sample, _median(self.evidence[reliable]), inside, rigid, affine)

    def merge(self, a: Group, b: Group) -> Group:
        """Both as one."""
        return self.group(np.concatenate([a.members, b.members]), np.concatenate([a.reliable, b.reliable]))

    def between(self, pairs: list[tuple[Group, Group]]) -> Array:
        """Measurements (N, 2 + len(CUES)) of pairs of groups: larger and smaller evidence, then `CUES`."""
        if not pairs:
            return np.empty((0, 2 + len(CUES)))
        edges = [shear.between_edges(self.anchor, a.sample, b.sample, self.pairs) for a, b in pairs]
        measured = zip(pairs, self._shears(edges), self._gaps(edges), strict=True)
        values = [self._between(a, b, float(between), float(gap)) for (a, b), between, gap in measured]
        return np.asarray(np.log(np.maximum(np.array(values), 1e-3)))

    def _shears(self, edges: list[Members]) -> Array:
        """Shear and stretch between the groups of each pair, the typical one where no edge was ever seen."""
        first = np.cumsum([0, *map(len, edges[:-1])])
        total, seen = (
            np.add.reduceat(part, first) for part in shear.totals(self.tracks, np.concatenate(edges))
        )
        return np.where(seen > 0, total / np.maximum(seen, 1), self.typical_inside)

    def _gaps(self, edges: list[Members]) -> Array:
        """Least distance of each pair, pixels: the edges come nearest first."""
        nearest = np.array([pair[0] for pair in edges])
        return np.asarray(np.linalg.norm(self.anchor[nearest[:, 0]] - self.anchor[nearest[:, 1]], axis=1))

    def _between(self, a: Group, b: Group, between: float, gap: float) -> list[float]:
        # Of two as large the one with the earlier point predicts, whichever is named first.
        small, large = sorted((a, b), key=lambda group: (len(group.reliable), -int(group.members[0])))
        insides = [g.inside if np.isfinite(g.inside) else self.typical_inside for g in (a, b)]
        return [
            max(a.evidence, b.evidence),
            min(a.evidence, b.evidence),
            _median(large.rigid[small.sample]) / self.noise,
            _median(large.affine[small.sample]) / self.noise,
            between / self.unit,
            between / max(sum(insides) / 2, 0.02 * self.unit),
            gap / self.unit,
            len(large.reliable),
            len(small.reliable),
        ]


def _median(values: Array) -> float:
    """Median of a few values; numpy's own spends ten times as long on its checks."""
    ordered, middle = np.sort(values), len(values) // 2
    return float(ordered[middle] if len(values) % 2 else (ordered[middle - 1] + ordered[middle]) / 2)
