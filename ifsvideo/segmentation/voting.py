"""What is doubtful is asked of a cut of all points at once, then of chance, until something is found twice.

Models are sampled at random, and where a thing hardly moves it is up to them whether its segments are pure
enough to be told from the ground. No score of a single segmentation tells whether it is right
(`ifsvideo/benchmark/TRIED.md`). But a cut of all points at once, told their number of motions, is another
view of the same tracks (`ifsvideo.segmentation.whole`), and what both find is hardly ever wrong. So the first
segmentation stands that it confirms, or that is found again. One motion too many, the ground in two parts,
is often confirmed as well; then the cut into one motion fewer confirms the ground in one, and how likely the
two parts are apart decides. Where the number is settled, but the cut is another, it is told how well the
points fit their groups: a group that is one motion is a static world, seen from itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.special import logit

from ifsvideo.segmentation.whole import Whole
from ifsvideo.segmentation.world import World
from ifsvideo.types import BACKGROUND, Segmentation

Labels = NDArray[np.int64]

_SURE = 0.05
"""Probability that its most doubtful merge, or pair left apart, is wrong, up to which a segmentation is sure
of its number of motions; half of Hopkins-155 are."""
_ALIKE = 0.02
"""Share of the points by which two segmentations may differ and be the same. A single point always may."""
_EXPLAINED = 2.0
"""Error of a point in the world of its group, in tolerances, from which on it is not explained, however far
it is off; 1 to 10 choose alike."""


def voted(
    segment: Callable[[], Segmentation], votes: int, whole: Whole, motions: int | None = None
) -> Segmentation:
    """The first segmentation that a cut of all points confirms, that is found again or is sure of its number
    of motions; where none is, that which resembles all most.

    What the cut does not confirm is taken as the cut into as many motions has it, if that fits better.

    Parameters
    ----------
    segment : callable
        Makes one, another one each time. Of ``details`` these are read: ``doubt``, how likely its most
        doubtful decision is wrong, without which the first one stands as it is; ``apart`` (G, G), how likely
        each two of its groups are two motions; ``world``, where the worlds of all groups start from, or None.
    votes : int
        How many are made at most; of one nothing is asked.
    whole : Whole
        The same tracks as a whole.
    motions : int, optional
        Number of motions, where it is known: none are joined then, nor is the cut ever taken, for what is
        told is seldom what is seen to move.
    """
    found: list[Segmentation] = []

    def settled(one: Segmentation) -> Segmentation:
        return one if motions is not None else _fitting(one, whole)

    for _ in range(max(votes, 1)):
        one = segment()
        if votes <= 1 or "doubt" not in one.details:
            return one
        sure = one.details["doubt"] <= _SURE
        if sure and not found:
            return settled(one)
        joined = one if sure or motions is not None else _with_one_ground(one, whole)
        if joined is not one or _confirmed(one.labels, whole):
            return joined
        for before in found:
            if _alike(before.labels, one.labels):
                return settled(before)
        found.append(one)
    away = [sum(difference(one.labels, other.labels) for other in found) for one in found]
    return settled(found[int(np.argmin(away))])


def difference(one: Labels, other: Labels) -> float:
    """Share of the points that two labellings (P,) put into different groups, whatever these are called."""
    if not len(one):
        return 0.0
    return float(np.count_nonzero(_named_alike(one, other) != other)) / len(one)


def _named_alike(one: Labels, other: Labels) -> Labels:
    """One labelling (P,) with the numbers of those groups of another that share most points; what has no
    counterpart has a number that is none."""
    (names, rows), (others, columns) = (np.unique(labels, return_inverse=True) for labels in (one, other))
    shared = np.zeros((len(names), len(others)), dtype=np.int64)
    np.add.at(shared, (rows, columns), 1)
    counterpart = np.full(len(names), np.iinfo(np.int64).min, dtype=np.int64)
    matched, to = linear_sum_assignment(shared, maximize=True)
    counterpart[matched] = others[to]
    return np.asarray(counterpart[rows])


def _alike(one: Labels, other: Labels) -> bool:
    """Whether two labellings (P,) are the same but for a few points."""
    return difference(one, other) * len(one) < max(_ALIKE * len(one), 1) + 1e-6


def _confirmed(labels: Labels, whole: Whole) -> bool:
    """Whether the cut into as many motions is the same."""
    cut = whole.cut(len(np.unique(labels)))
    return cut is not None and _alike(labels, cut.labels)


def _with_one_ground(found: Segmentation, whole: Whole) -> Segmentation:
    """The segmentation without a doubtful motion: two groups that the cut into one motion fewer has as one,
    while all others are the same, are one unless they are surely apart.

    How sure the segmentation is of that is weighed with how sure the cuts are: the odds that the two are
    apart times how much less certain the cut into fewer is. In noise even odds suffice: it hides what parts
    two motions from the cut into fewer, and the ground is in two parts less often.
    """
    groups = np.unique(found.labels).tolist()
    fewer, same = whole.cut(len(groups) - 1), whole.cut(len(groups))
    if fewer is None or same is None:
        return found
    joined = {(a, b): np.where(found.labels == b, a, found.labels) for a, b in combinations(groups, 2)}
    pair = min(joined, key=lambda pair: difference(joined[pair], fewer.labels))
    if not _alike(joined[pair], fewer.labels):
        return found
    odds = logit(found.details["apart"][pair]) + np.log(fewer.uncertainty / same.uncertainty)
    surely = logit(0.5 if whole.noisy else 1 - _SURE)
    return found if odds > surely else _with_one_ground(_joined(found, *pair), whole)


def _joined(found: Segmentation, first: int, second: int) -> Segmentation:
    """The segmentation with its second group as part of the first, movers numbered by size again."""
    labels, confidence, apart = found.labels.copy(), found.confidence.copy(), found.details["apart"].copy()
    confidence[labels == second] = np.median(confidence[labels == first])
    labels[labels == second] = first
    # Both parts must be doubtful for a third group to join them.
    apart[first] = apart[:, first] = np.maximum(apart[first], apart[second])
    movers, sizes = np.unique(labels[labels > BACKGROUND], return_counts=True)
    old = np.concatenate([[BACKGROUND], movers[np.argsort(-sizes, kind="stable")]])
    new = np.zeros(len(apart), dtype=np.int64)
    new[old] = np.arange(len(old))
    details = dict(found.details, apart=apart[np.ix_(old, old)])
    return replace(found, labels=new[labels], confidence=confidence, details=details)


def _fitting(found: Segmentation, whole: Whole) -> Segmentation:
    """The segmentation, or the cut into as many motions if that is another one and fits better.

    Both before an affine camera, whose subspaces mislead where a street goes on into the distance, and before
    one that sees in perspective, whose worlds are sometimes not found.
    """
    world, cut = found.details["world"], whole.cut(len(np.unique(found.labels)))
    if world is None or cut is None or _alike(found.labels, cut.labels):
        return found
    if whole.misfit(cut.labels) >= whole.misfit(found.labels):
        return found
    if _misfit(cut.labels, world) >= _misfit(found.labels, world):
        return found
    labels = _named_alike(cut.labels, found.labels)
    confidence = found.confidence.copy()
    for group in np.unique(labels):
        confidence[(labels == group) & (found.labels != group)] = np.median(
            found.confidence[found.labels == group]
        )
    return replace(found, labels=labels, confidence=confidence)


def _misfit(labels: Labels, world: World) -> float:
    """How badly the points fit the perspective worlds of their groups, each fitted to these points alone.

    As `Whole.misfit`, but in tolerances.
    """
    error = np.zeros(len(labels))
    for group in np.unique(labels):
        members = np.flatnonzero(labels == group)
        own = world.fitted_to(members)
        error[members] = np.nan_to_num(own.rms / own.tolerance)[members]
    return float(np.minimum(error, _EXPLAINED).mean())
