"""Stage 5, weighing evidence: segments merge in the order of how likely they are one motion, until none is.

The thesis's predicate compares shear between two segments with shear inside them. On a road that parts a
static scene by its depth, so shear is one cue of several here (`cues`), and a learnt rule (`similarity`)
weighs them. They are measured anew after each merge: what many points tell is surer than what few do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage

from ifsvideo.segmentation.cues import Cues, Group, Members
from ifsvideo.segmentation.similarity import Similarity

Apart = dict[tuple[int, int], float]
"""How likely pairs of groups, the smaller number first, are two motions."""

SURE = 0.02
"""Probability of being two motions up to which segments that are all so much alike merge at once, and are
measured anew once: most merges are as sure as that."""


@dataclass(frozen=True)
class Window:
    """What stage 5 starts from.

    Attributes
    ----------
    segments : (P,) int
        Segment of each point, from 0.
    explained : (P,) bool
        Whether its segment's model explains the point; the others are carried along, not measured.
    size : (width, height) of the picture, pixels
    """

    segments: NDArray[np.int64]
    explained: NDArray[np.bool_]
    size: tuple[int, int]

    def joined(self, segments: NDArray[np.int64]) -> Window:
        """The same window where some segments are one."""
        if len(segments) < 2:
            return self
        as_one = np.where(np.isin(self.segments, segments), segments[0], self.segments)
        return replace(self, segments=np.unique(as_one, return_inverse=True)[1].astype(np.int64))

    def parts(self) -> list[tuple[Members, Members]]:
        """Points of each segment, and those of them that are measured: the explained ones where there are
        two."""
        parts = []
        for s in range(int(self.segments.max(initial=-1)) + 1):
            members = np.flatnonzero(self.segments == s)
            reliable = members[self.explained[members]]
            parts.append((members, reliable if len(reliable) >= 2 else members))
        return parts


@dataclass
class Agglomeration:
    """Merges the segments of one window.

    Attributes
    ----------
    merges : list of (int, int, float)
        Which groups were merged, in order, and how likely they were two; segments count from 0, each merge
        makes the next number.
    doubt : float
        How likely the most doubtful decision is wrong: a merge of two motions, or one that is left as two.
    """

    cues: Cues
    similarity: Similarity
    merges: list[tuple[int, int, float]] = field(default_factory=list)
    doubt: float = 0.0

    def run(self, window: Window, motions: int | None = None, stop: float = 0.5) -> list[Group]:
        """Merge segments until the best pair is two motions with probability ``stop``, or ``motions`` are
        left: surely alike ones at once, then the best pair after the other."""
        return self.merge(self.cues.groups(window.parts()), motions, stop)

    def merge(self, parts: Sequence[Group], motions: int | None = None, stop: float = 0.5) -> list[Group]:
        """The same from groups that were measured already."""
        groups, merges_before = dict(enumerate(parts)), len(self.merges)

        def join(sets: Sequence[Sequence[int]]) -> None:
            wholes = []
            for first, *others in sets:
                known = [first]
                for other in others:
                    cost = max(apart[before, other] for before in known)
                    self.merges.append((min(first, other), max(first, other), cost))
                    first = len(parts) + len(self.merges) - merges_before - 1
                    known.append(other)
                wholes.append(first)
            # Measured once, however many they are.
            merged = self.cues.merge_each([[groups.pop(number) for number in numbers] for numbers in sets])
            groups.update(zip(wholes, merged, strict=True))

        apart = self._apart(groups, {})
        # Told how many, one pair at a time: sets might leave fewer.
        while motions is None and (alike := _alike(list(groups), apart, min(SURE, stop))):
            join(alike)
            apart = self._apart(groups, apart)
        while apart:
            pair, cost = min(apart.items(), key=lambda item: (item[1], item[0]))
            if cost > stop if motions is None else len(groups) <= motions:
                break
            join([pair])
            apart = self._apart(groups, apart)
        merged = (cost for *_, cost in self.merges[merges_before:])
        self.doubt = max(self.doubt, *merged, *(1 - cost for cost in apart.values()), 0.0)
        return list(groups.values())

    def apart(self, a: Group, b: Group) -> float:
        """Probability that two groups are two motions."""
        return float(self.similarity.apart(self.cues.between([(a, b)]))[0])

    def _apart(self, groups: dict[int, Group], known: Apart) -> Apart:
        """Probability of each pair that it is two motions, as far as it is not known already."""
        pairs = list(combinations(groups, 2))
        new = [pair for pair in pairs if pair not in known]
        measured = self.cues.between([(groups[i], groups[j]) for i, j in new])
        told = known | dict(zip(new, self.similarity.apart(measured).tolist(), strict=True))
        return {pair: told[pair] for pair in pairs}


def _alike(numbers: Sequence[int], apart: Apart, most: float) -> list[list[int]]:
    """Sets of two and more groups, of which each pair is two motions with at most this probability."""
    costs = [apart[pair] for pair in combinations(numbers, 2)]
    if min(costs, default=np.inf) > most:
        return []
    part = fcluster(linkage(costs, "complete"), most, "distance")
    sets = [[number for number, own in zip(numbers, part, strict=True) if own == p] for p in np.unique(part)]
    return [members for members in sets if len(members) > 1]
