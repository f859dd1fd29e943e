"""Stage 5, weighing evidence: segments merge in the order of how likely they are one motion, until none is.

The thesis's predicate compares shear between two segments with shear inside them. On a road that parts a
static scene by its depth, so it is asked only of what moves. Two segments are one motion if both stand still
in the world, or if both move and move alike::

    P(same) = (1 - p_i) (1 - p_j) + p_i p_j a_ij

p is the probability that a segment moves, from how far its points are from any static point's way (`world`),
a that two moving segments move alike, from rigidity (`lowrank`), shear, and the gap between them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from ifsvideo.segmentation import shear
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.lowrank import rigid_residual
from ifsvideo.types import Tracks

Array = NDArray[np.float64]
Members = NDArray[np.int64]

_MOST = 100
"""Points of a segment that its rigidity is judged by; more tell nothing new."""


@dataclass(frozen=True)
class Group:
    """A segment, or several that were merged.

    Attributes
    ----------
    members : (n,) int, indices of points
    reliable : (n',) int, those of them that their segment's model explains
    moving : float, probability that the group moves in the world
    inside : float, shear inside it, NaN where it has no edge
    centre, spread : (2,) float and float, where it lies in the base frame, pixels
    """

    members: Members
    reliable: Members
    moving: float
    inside: float
    centre: Array
    spread: float


@dataclass
class Agglomeration:
    """The evidence of one window, and the groups that it makes.

    Parameters
    ----------
    tracks : Tracks
    anchor : (P, 2) float, places in the base frame, pixels
    evidence : (P,) float
        Distance from a static point's way in units of what is usual in this window; above 1 speaks for
        motion.
    tolerance : (P,) float, pixels, error that a point's track is granted
    unit : float, pixels per configured pixel
    """

    tracks: Tracks
    anchor: Array
    evidence: Array
    tolerance: Array
    unit: float
    config: SegmenterConfig
    merges: list[tuple[int, int, float]] = field(default_factory=list)

    def run(
        self, segments: NDArray[np.int64], explained: NDArray[np.bool_], motions: int | None
    ) -> list[Group]:
        """Merge segments until the best pair is more likely two motions than one, or ``motions`` are left."""
        groups: dict[int, Group] = {}
        for s in range(int(segments.max(initial=-1)) + 1):
            members = np.flatnonzero(segments == s)
            reliable = members[explained[members]]
            groups[s] = self._group(members, reliable if len(reliable) >= 2 else members)
        insides = [g.inside for g in groups.values() if np.isfinite(g.inside)]
        self._typical = float(np.median(insides)) if insides else 0.0
        apart = {(i, j): self._apart(groups[i], groups[j]) for i in groups for j in groups if i < j}
        following = len(groups)
        while apart:
            (i, j), cost = min(apart.items(), key=lambda item: (item[1], item[0]))
            if cost > 0.5 if motions is None else len(groups) <= motions:
                break
            self.merges.append((i, j, cost))
            merged = self._merge(groups.pop(i), groups.pop(j))
            apart = {pair: c for pair, c in apart.items() if i not in pair and j not in pair}
            apart |= {(k, following): self._apart(group, merged) for k, group in groups.items()}
            groups[following] = merged
            following += 1
        return list(groups.values())

    def _group(self, members: Members, reliable: Members, moving: float | None = None) -> Group:
        place = self.anchor[reliable]
        centre = np.median(place, axis=0)
        inside = float("nan")
        if moving is None:
            moving = self._moving(reliable)
        if moving > 0.05 and len(reliable) >= 3:
            inside = shear.score(
                self.tracks, shear.inside_edges(self.anchor, reliable[:: 1 + len(reliable) // _MOST])
            )
        spread = float(np.sqrt(place.var(axis=0).sum()))
        return Group(members, reliable, moving, inside, centre, spread)

    def _moving(self, points: Members) -> float:
        """Probability that most of these points move, few points being no more than a hint."""
        typical = float(np.median(self.evidence[points]))
        doubt = self.config.few_points_doubt / len(points)
        return float(expit(self.config.evidence_slope * np.log(max(typical, 1e-3)) - doubt))

    def _merge(self, a: Group, b: Group) -> Group:
        members = np.concatenate([a.members, b.members])
        reliable = np.concatenate([a.reliable, b.reliable])
        # What is still remains so: a wide background with one odd corner must not be talked into moving by
        # it.
        still = max(a.moving, b.moving) < 0.5
        return self._group(members, reliable, min(a.moving, b.moving) if still else None)

    def _apart(self, a: Group, b: Group) -> float:
        """Probability that two groups are different motions."""
        both_move = a.moving * b.moving
        same = (1 - a.moving) * (1 - b.moving)
        if both_move > 0.02:
            same += both_move * self._alike(a, b)
        return 1 - same

    def _alike(self, a: Group, b: Group) -> float:
        """Probability that two moving groups move alike."""
        config = self.config
        first = a.reliable[:: 1 + len(a.reliable) // _MOST]
        second = b.reliable[:: 1 + len(b.reliable) // _MOST]
        distance = np.linalg.norm(self.anchor[first][:, None] - self.anchor[second][None], axis=2)
        gap = float(distance.min()) / self.unit
        odds = config.gap_slope * (1 - gap / config.gap)
        if odds < -10:
            return 0.0
        both = np.concatenate([first, second])
        error = rigid_residual(self.tracks.select(both)) / self.tolerance[both]
        bend = max(float(np.median(error[: len(first)])), float(np.median(error[len(first) :])))
        odds -= config.rigidity_slope * np.log(max(bend, 1e-3) / config.rigidity)
        between = shear.score(self.tracks, shear.between_edges(self.anchor, first, second, config.pairs))
        if np.isfinite(between):
            insides = [g if np.isfinite(g) else self._typical for g in (a.inside, b.inside)]
            ratio = between / max(sum(insides) / 2, 0.02 * self.unit)
            odds -= config.shear_slope * np.log(max(ratio, 1e-3) / config.shear_ratio)
        return float(expit(odds))
