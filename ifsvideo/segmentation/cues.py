"""What stage 5 knows of two segments: the measurements by which they are told to be one motion or two.

All are logarithms, so that a linear rule weighs ratios: twice the shear, half the gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation import shear
from ifsvideo.segmentation.leeway import Leeway
from ifsvideo.segmentation.lowrank import Subspace, stacks, trajectory_matrix
from ifsvideo.segmentation.median import median
from ifsvideo.types import Tracks

Array = NDArray[np.float64]
Members = NDArray[np.int64]

CUES = ("rigid", "affine", "shear", "shear_ratio", "gap", "larger", "smaller", "depth")
"""Names of what is measured between two segments, in the order of the columns of `Cues.between`:

rigid, affine : how far the smaller one's points are from the larger one's rank-3 and rank-2 subspace, over
    what is usual inside segments (cross prediction; perspective fails it, too, over deep scenes)
shear : in-frame shear and stretch between nearest points, a frame (thesis Algorithm 2)
shear_ratio : the same over that inside the two (the thesis's predicate)
gap : least distance between their points
larger, smaller : their numbers of points
depth : how far apart they are in nearness to the camera, over the spread of both: where a camera path is
    found that makes one static world of two movers, each lies flat at a depth of its own, while a street goes
    on from one segment to the next
"""

_MOST = 60
"""Points by which a segment is measured; more tell nothing new."""
_KEY_FRAMES = 12
"""Frames in which subspaces are fitted: a motion is smooth, and more would cost time and tell little."""
_LEAST_FOR_NOISE = 6
"""Points that a segment needs to tell how noisy tracks are; fewer fit any subspace."""
_LEAST_NOISE = 0.05
"""Pixels; no tracker is better."""
_LEAST_SPREAD = 0.02
"""Least spread of nearness, over nearness: a window fixes depths no better."""
_SAME_DEPTH = 0.1
"""Added to ``depth``, whose logarithm would weigh nothing against next to nothing otherwise."""


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
    yielding : float
        The same after the cameras gave way to them (`ifsvideo.segmentation.leeway`), at most as much.
    depth : (3,) float, nearness below which a tenth, half and nine tenths of the reliable points lie
    inside : float, shear inside it, NaN where it has no edge
    rigid, affine : (P,) float, distance of every point from its rank-3 and rank-2 subspace, pixels
    """

    members: Members
    reliable: Members
    sample: Members
    evidence: float
    yielding: float
    depth: Array
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
    nearness : (P,) float
        How near the camera a point is if it is static (`ifsvideo.segmentation.world.World.nearness`).
    unit : float, pixels of a picture per pixel of a 640x480 one
    pairs : int
        Pairs of points between which shear is measured.
    """

    def __init__(
        self, tracks: Tracks, anchor: Array, evidence: Array, nearness: Array, unit: float, pairs: int
    ) -> None:
        self.tracks, self.anchor, self.unit, self.pairs = tracks, anchor, unit, pairs
        self.evidence, self.nearness = evidence, nearness
        self.W, self.seen = trajectory_matrix(tracks, _KEY_FRAMES)
        self.noise = self.typical_inside = 0.0
        self.leeway: Leeway | None = None
        self._groups: dict[bytes, Group] = {}
        self._worldly: dict[bytes, dict[str, Any]] = {}
        self._pairs: dict[tuple[bytes, bytes], list[float]] = {}

    def __getstate__(self) -> dict[str, object]:
        """Without what was kept only to be fast."""
        return self.__dict__ | {"_groups": {}, "_pairs": {}, "_worldly": {}}

    def in_world(self, evidence: Array, nearness: Array, leeway: Leeway | None = None) -> Cues:
        """The same window in another static world: what groups were measured for by then is kept."""
        other = copy(self)
        other.evidence, other.nearness, other.leeway = evidence, nearness, leeway
        other._worldly = {}
        other._groups, other._pairs = self._groups, self._pairs  # copy, like pickle, leaves them out
        return other

    def groups(self, segments: list[tuple[Members, Members]]) -> list[Group]:
        """Groups of the segments that a window starts with: (members, reliable) each. The first that are
        asked for tell how noisy tracks are, and what shear is usual inside a segment."""
        found = self._each(segments)
        if not self.noise:
            own = [median(g.rigid[g.sample]) for g in found if len(g.sample) >= _LEAST_FOR_NOISE]
            insides = [g.inside for g in found if np.isfinite(g.inside)]
            self.noise = max(float(np.median(own)) if own else 0.0, _LEAST_NOISE * self.unit)
            self.typical_inside = float(np.median(insides)) if insides else 0.0
        return found

    def group(self, members: Members, reliable: Members) -> Group:
        """Measure a group by itself."""
        return self._each([(members, reliable)])[0]

    def _each(self, parts: list[tuple[Members, Members]]) -> list[Group]:
        keys = [reliable.tobytes() for _, reliable in parts]
        new = {key: part for key, part in zip(keys, parts, strict=True) if key not in self._groups}
        self._groups.update(zip(new, self._measured(list(new.values())), strict=True))
        self._place([key for key in dict.fromkeys(keys) if key not in self._worldly])
        return [
            replace(self._groups[key], members=members, **self._worldly[key])
            for key, (members, _) in zip(keys, parts, strict=True)
        ]

    def _place(self, keys: list[bytes]) -> None:
        """Keep what groups are in this static world: both evidences, and the depth."""
        groups = [self._groups[key] for key in keys]
        evidence = [median(self.evidence[group.reliable]) for group in groups]
        samples = [group.sample for group in groups]
        yielding = evidence if self.leeway is None else self.leeway.evidence(samples)
        for key, group, held, gave_way in zip(keys, groups, evidence, yielding, strict=True):
            depth = _deciles(self.nearness[group.reliable])
            self._worldly[key] = {"evidence": held, "yielding": gave_way, "depth": depth}

    def _measured(self, parts: list[tuple[Members, Members]]) -> list[Group]:
        """What does not depend on the static world."""
        samples = [reliable[:: 1 + (len(reliable) - 1) // _MOST] for _, reliable in parts]
        rigid, affine = (np.empty((len(parts), self.W.shape[1])) for _ in range(2))
        # In one go: of a few points most of the time is taken by calls, not by numbers.
        for which, W, seen in stacks(self.W, self.seen, samples, 3):
            space = Subspace.fit(W, seen, 3)
            rigid[which] = space.distance(self.W, self.seen)
            affine[which] = space.main(W, seen, 2).distance(self.W, self.seen)
        inside = shear.scores(self.tracks, [shear.inside_edges(self.anchor, sample) for sample in samples])
        return [
            Group(members, reliable, sample, 0.0, 0.0, np.zeros(3), *measured)
            for (members, reliable), sample, *measured in zip(
                parts, samples, inside.tolist(), rigid, affine, strict=True
            )
        ]

    def merge(self, groups: Sequence[Group]) -> Group:
        """Some groups as one."""
        return self.merge_each([groups])[0]

    def merge_each(self, sets: Sequence[Sequence[Group]]) -> list[Group]:
        """The same of several sets of groups, measured in one go."""
        return self._each(
            [
                (np.concatenate([g.members for g in own]), np.concatenate([g.reliable for g in own]))
                for own in sets
            ]
        )

    def between(self, pairs: list[tuple[Group, Group]]) -> Array:
        """Measurements (N, 4 + len(CUES)) of pairs of groups: larger and smaller evidence, the same after the
        cameras gave way, then `CUES`."""
        if not pairs:
            return np.empty((0, 4 + len(CUES)))
        keys = [(a.reliable.tobytes(), b.reliable.tobytes()) for a, b in pairs]
        self._measure({key: pair for key, pair in zip(keys, pairs, strict=True) if key not in self._pairs})
        values = [
            [*_both(a.evidence, b.evidence), *_both(a.yielding, b.yielding), *self._pairs[key], _depth(a, b)]
            for key, (a, b) in zip(keys, pairs, strict=True)
        ]
        return np.asarray(np.log(np.maximum(np.array(values), 1e-3)))

    def _measure(self, pairs: dict[tuple[bytes, bytes], tuple[Group, Group]]) -> None:
        """Keep what does not depend on the static world."""
        if not pairs:
            return
        edges = [shear.between_edges(self.anchor, a.sample, b.sample, self.pairs) for a, b in pairs.values()]
        shears = shear.scores(self.tracks, edges)
        # The typical one where no edge was ever seen.
        shears = np.where(np.isfinite(shears), shears, self.typical_inside)
        measured = zip(pairs.items(), shears.tolist(), self._gaps(edges), strict=True)
        for (key, (a, b)), between, gap in measured:
            self._pairs[key] = self._between(a, b, between, float(gap))

    def _gaps(self, edges: list[Members]) -> Array:
        """Least distance of each pair, pixels: the edges come nearest first."""
        nearest = np.array([pair[0] for pair in edges])
        return np.asarray(np.linalg.norm(self.anchor[nearest[:, 0]] - self.anchor[nearest[:, 1]], axis=1))

    def _between(self, a: Group, b: Group, between: float, gap: float) -> list[float]:
        # Of two as large the one with the earlier point predicts, whichever is named first.
        small, large = sorted((a, b), key=lambda group: (len(group.reliable), -int(group.members[0])))
        insides = [g.inside if np.isfinite(g.inside) else self.typical_inside for g in (a, b)]
        return [
            median(large.rigid[small.sample]) / self.noise,
            median(large.affine[small.sample]) / self.noise,
            between / self.unit,
            between / max(sum(insides) / 2, 0.02 * self.unit),
            gap / self.unit,
            len(large.reliable),
            len(small.reliable),
        ]


def _both(a: float, b: float) -> tuple[float, float]:
    """The larger one first."""
    return (a, b) if a > b else (b, a)


def _depth(a: Group, b: Group) -> float:
    """Difference of two groups' nearness over the spread of both."""
    (a_far, a_mid, a_near), (b_far, b_mid, b_near) = a.depth.tolist(), b.depth.tolist()
    spread = a_near - a_far + b_near - b_far + _LEAST_SPREAD * max(a_mid, b_mid) + 1e-3
    return float(abs(a_mid - b_mid) / spread + _SAME_DEPTH)


def _deciles(values: Array) -> Array:
    """Where a tenth, half and nine tenths of a few values lie below; as of `median`."""
    ordered, place = np.sort(values), np.array([0.1, 0.5, 0.9]) * (len(values) - 1)
    low = place.astype(np.int64)
    below, above = ordered[low], ordered[np.minimum(low + 1, len(values) - 1)]
    return np.asarray(below + (above - below) * (place - low))
