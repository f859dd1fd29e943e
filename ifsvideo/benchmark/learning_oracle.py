"""From a labelled sequence to pairs of groups of which is known whether they are one motion.

Its segments are merged as an oracle would, only where they are one motion, so that pairs are met as stage 5
meets them: small segments at first, large groups at last.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ifsvideo.benchmark.learning_data import Example
from ifsvideo.segmentation.agglomeration import Window
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.cues import Cues, Group
from ifsvideo.segmentation.segmenter import IFSSegmenter

Array = NDArray[np.float64]

PURE = 0.8
"""Share of a segment's labelled points that must be of one motion, else nobody can say where it belongs."""
FIRST_PAIRS = 80
"""Pairs of segments measured before anything merges."""
PAIRS_PER_MERGE = 8
"""Pairs measured with each merged group."""
SIZE_POWER = 0.7
"""A pair counts with (points of the smaller group) to this power: a wrong merge costs points, but merging
starts with small segments."""


@dataclass(frozen=True)
class Pairs:
    """Pairs of groups on the way of an oracle.

    Attributes
    ----------
    measured : (N, 4 + len(CUES)) float
        As of `Cues.between`.
    apart : (N,) bool
        Whether the two are different motions.
    smaller : (N,) float
        Number of points of the smaller group.
    """

    measured: Array
    apart: NDArray[np.bool_]
    smaller: Array

    def weights(self) -> Array:
        """What each pair counts: those of one motion one half together, those of two the other."""
        size = self.smaller**SIZE_POWER
        total = np.where(self.apart, size[self.apart].sum(), size[~self.apart].sum())
        return np.asarray(size / (2 * total))


@dataclass(frozen=True)
class Task:
    """A sequence, to be taken to segments once."""

    example: Example
    config: SegmenterConfig
    seed: int

    def __str__(self) -> str:
        return f"{self.example.sequence.name}, seed {self.seed}"


@dataclass(frozen=True)
class Staged:
    """What a sequence is when the second pass of stage 5 starts.

    Attributes
    ----------
    usable : (U,) int
        Points that were segmented; all arrays below have one entry for each of them.
    window : Window
        The segments of stage 4; all their pairs are learnt from.
    joined : Window
        The same, those of the static core as one: where the second pass starts.
    cues : Cues
        What is measured in the world of the static core.
    """

    task: Task
    usable: NDArray[np.int64]
    window: Window
    joined: Window
    cues: Cues

    @classmethod
    def of(cls, task: Task) -> Staged:
        """Run stages 1 to 4, and the first pass of stage 5 with the rule that the package has for it."""
        found = IFSSegmenter(task.config, task.seed).segment(task.example.sequence.tracks)
        kept = found.details
        return cls(task, kept["usable"], kept["window"], kept["joined"], kept["cues"])

    @property
    def truth(self) -> NDArray[np.int64]:
        """True group (U,) of the points, 0 where it is not known."""
        return self.task.example.sequence.truth[self.usable]


def oracle_pairs(staged: Staged) -> Pairs:
    """Merge what is truly one motion, near groups first with some randomness; measure pairs on the way."""
    rng, cues = np.random.default_rng(staged.task.seed), staged.cues
    parts = cues.groups(staged.window.parts())
    known = {number: (part, _motion(staged.truth[part.reliable])) for number, part in enumerate(parts)}
    known = {number: entry for number, entry in known.items() if entry[1]}
    pairs = list(combinations(known, 2))
    asked = [pairs[k] for k in rng.permutation(len(pairs))[:FIRST_PAIRS]]
    seen = [(*known[i], *known[j]) for i, j in asked]
    following = len(parts)
    while same := [(i, j) for i, j in combinations(known, 2) if known[i][1] == known[j][1]]:
        gaps = np.array([_distance(cues, known[i][0], known[j][0]) for i, j in same])
        i, j = same[int(np.argmin(gaps * rng.exponential(1.0, len(gaps))))]
        (one, motion), (other, _) = known.pop(i), known.pop(j)
        merged = cues.merge([one, other])
        rest = list(known)
        chosen = [known[rest[k]] for k in rng.permutation(len(rest))[:PAIRS_PER_MERGE]]
        seen += [(*entry, merged, motion) for entry in chosen]
        known[following] = merged, motion
        following += 1
    return Pairs(
        cues.between([(a, b) for a, _, b, _ in seen]),
        np.array([first != second for _, first, _, second in seen], dtype=bool),
        np.array([min(len(a.members), len(b.members)) for a, _, b, _ in seen], dtype=np.float64),
    )


def _motion(truth: NDArray[np.int64]) -> int:
    """True motion of a segment's points, 0 where too few are known or they are not of one."""
    known = truth[truth > 0]
    if len(known) < 2:
        return 0
    counts = np.bincount(known)
    return int(counts.argmax()) if counts.max() >= PURE * len(known) else 0


def _distance(cues: Cues, a: Group, b: Group) -> float:
    """Distance of two groups' middles, pixels."""
    return float(np.linalg.norm(cues.anchor[a.reliable].mean(axis=0) - cues.anchor[b.reliable].mean(axis=0)))


def prepare(task: Task) -> tuple[Staged, Pairs]:
    """A sequence up to the second pass of stage 5, and an oracle's pairs of it there."""
    staged = Staged.of(task)
    return staged, oracle_pairs(staged)
