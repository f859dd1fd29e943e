"""Stage 5, weighing evidence: segments merge in the order of how likely they are one motion, until none is.

The thesis's predicate compares shear between two segments with shear inside them. On a road that parts a
static scene by its depth, so shear is one cue of several here (`cues`), and a learnt rule (`similarity`)
weighs them. They are measured anew after each merge: what many points tell is surer than what few do.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation.cues import Cues, Group, Members
from ifsvideo.segmentation.similarity import Similarity


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
    """

    cues: Cues
    similarity: Similarity
    merges: list[tuple[int, int, float]] = field(default_factory=list)

    def run(self, window: Window, motions: int | None = None, stop: float = 0.5) -> list[Group]:
        """Merge segments until the best pair is two motions with probability ``stop``, or ``motions`` are
        left."""
        return self.merge(self.cues.groups(window.parts()), motions, stop)

    def merge(self, parts: list[Group], motions: int | None = None, stop: float = 0.5) -> list[Group]:
        """The same from groups that were measured already."""
        groups = dict(enumerate(parts))
        apart = self._apart(groups, [(i, j) for i in groups for j in groups if i < j])
        following = len(groups)
        while apart:
            (i, j), cost = min(apart.items(), key=lambda item: (item[1], item[0]))
            if cost > stop if motions is None else len(groups) <= motions:
                break
            self.merges.append((i, j, cost))
            merged = self.cues.merge(groups.pop(i), groups.pop(j))
            apart = {pair: c for pair, c in apart.items() if i not in pair and j not in pair}
            groups[following] = merged
            apart |= self._apart(groups, [(k, following) for k in groups if k != following])
            following += 1
        return list(groups.values())

    def apart(self, a: Group, b: Group) -> float:
        """Probability that two groups are two motions."""
        return float(self.similarity.apart(self.cues.between([(a, b)]))[0])

    def _apart(self, groups: dict[int, Group], pairs: list[tuple[int, int]]) -> dict[tuple[int, int], float]:
        """Probability of each pair that it is two motions."""
        measured = self.cues.between([(groups[i], groups[j]) for i, j in pairs])
        return dict(zip(pairs, self.similarity.apart(measured).tolist(), strict=True))
