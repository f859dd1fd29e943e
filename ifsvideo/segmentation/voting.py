"""What chance decides is tried again, until two segmentations agree.

Models are sampled at random, and where a thing hardly moves it is up to them whether its segments are pure
enough to be told from the ground. Where one segmentation is sure of all its merges it stands. Else others are
made: what is right is found again, mistakes are seldom made twice. No score of a single one tells which is
right (`ifsvideo/benchmark/TRIED.md`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from ifsvideo.types import Segmentation

_SURE = 0.05
"""Probability that its most doubtful merge, or pair left apart, is wrong, up to which a segmentation stands;
half of Hopkins-155 do."""
_ALIKE = 0.02
"""Share of the points by which two segmentations may differ and be the same."""


def voted(segment: Callable[[], Segmentation], votes: int) -> Segmentation:
    """The first segmentation that is sure or is found twice; where none is, that which resembles all most.

    Parameters
    ----------
    segment : callable
        Makes one, another one each time; ``details["doubt"]`` is how likely its most doubtful decision is
        wrong, without it there was none.
    votes : int
        How many are made at most.
    """
    found = [segment()]
    if found[0].details.get("doubt", 0.0) <= _SURE:
        return found[0]
    while len(found) < votes:
        again = segment()
        for before in found:
            if difference(before.labels, again.labels) <= _ALIKE:
                return before
        found.append(again)
    away = [sum(difference(one.labels, other.labels) for other in found) for one in found]
    return found[int(np.argmin(away))]


def difference(one: NDArray[np.int64], other: NDArray[np.int64]) -> float:
    """Share of the points that two labellings (P,) put into different groups, whatever these are called."""
    if not len(one):
        return 0.0
    rows, columns = (np.unique(labels, return_inverse=True)[1] for labels in (one, other))
    shared = np.zeros((rows.max() + 1, columns.max() + 1), dtype=np.int64)
    np.add.at(shared, (rows, columns), 1)
    return 1 - float(shared[linear_sum_assignment(shared, maximize=True)].sum()) / len(one)
