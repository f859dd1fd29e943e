"""How labels are scored against the truth; every figure is in per cent.

None stands where there is nothing to score (a precision where nothing is called moving).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

Labels = NDArray[np.integer[Any]]


def percent(part: float, whole: float) -> float | None:
    """100 x part / whole, None where the whole is 0."""
    return 100.0 * part / whole if whole else None


def overlaps(estimated: Labels, true: Labels) -> NDArray[np.int64]:
    """Count how many points each pair of an estimated and a true label shares.

    Parameters
    ----------
    estimated, true : (P,) int
        Label of each point, any numbers.

    Returns
    -------
    (E, T) int64
        One row for each distinct estimated label, one column for each true one, both ascending.
    """
    rows, row = np.unique(estimated, return_inverse=True)
    columns, column = np.unique(true, return_inverse=True)
    counts = np.zeros((len(rows), len(columns)), dtype=np.int64)
    np.add.at(counts, (row, column), 1)
    return counts


def best_matching(estimated: Labels, true: Labels) -> int:
    """Greatest number of points that a one-to-one matching of estimated to true labels gets right."""
    counts = overlaps(estimated, true)
    rows, columns = linear_sum_assignment(counts, maximize=True)
    return int(counts[rows, columns].sum())


def matching(estimated: Labels, true: Labels) -> dict[int, int]:
    """Estimated label of each true one in that matching; a true label that is left over is not there."""
    rows, columns = linear_sum_assignment(overlaps(estimated, true), maximize=True)
    found, groups = np.unique(estimated), np.unique(true)
    return {int(groups[column]): int(found[row]) for row, column in zip(rows, columns, strict=True)}


def error(estimated: Labels, true: Labels) -> float:
    """Misclassified points, per cent of the labelled ones.

    Parameters
    ----------
    estimated : (P,) int
        As in `ifsvideo.types.Segmentation`; -1 is always wrong.
    true : (P,) int
        Groups from 1; points with 0 are not counted.

    Raises
    ------
    ValueError
        If no point carries a true label.
    """
    counted = true > 0
    total = int(counted.sum())
    if not total:
        raise ValueError("no point carries a true label")
    decided = counted & (estimated >= 0)
    return 100.0 * (1.0 - best_matching(estimated[decided], true[decided]) / total)


def group_count(estimated: Labels, true: Labels) -> int:
    """Number of groups that labelled points are put into, background included, -1 not."""
    return len(np.unique(estimated[(true > 0) & (estimated >= 0)]))


@dataclass(frozen=True)
class MovesCount:
    """Points that are truly moving, called moving, and both; counts add up over clips and runs."""

    both: int = 0
    called: int = 0
    truly: int = 0

    @classmethod
    def of(cls, called: NDArray[np.bool_], truly: NDArray[np.bool_]) -> MovesCount:
        """Count two masks (P,)."""
        return cls(int((called & truly).sum()), int(called.sum()), int(truly.sum()))

    def __add__(self, other: MovesCount) -> MovesCount:
        return MovesCount(self.both + other.both, self.called + other.called, self.truly + other.truly)

    def as_dict(self) -> dict[str, float | None]:
        """``{"precision", "recall"}``, per cent."""
        return {"precision": percent(self.both, self.called), "recall": percent(self.both, self.truly)}


def moves(estimated: Labels, true: Labels) -> MovesCount:
    """Count what moves: truly if the group is not 1, called so if the label is > 0; (P,) int each."""
    counted = true > 0
    return MovesCount.of(estimated[counted] > 0, true[counted] > 1)


def idf1(estimated: Labels, true: Labels) -> float | None:
    """Identity F1 of objects that keep their number, per cent (Ristani et al., ECCV workshops 2016).

    Parameters
    ----------
    estimated, true : (N,) int
        Object of each row of a whole clip; 0 or less is no object.

    Returns
    -------
    float or None
        100 x 2 IDTP / (2 IDTP + IDFP + IDFN): IDTP are the rows that the best one-to-one matching of
        numbers over the whole clip gets right. None where there is neither a true nor an estimated object.
    """
    both = (estimated > 0) & (true > 0)
    matched = best_matching(estimated[both], true[both])
    return percent(2 * matched, int((estimated > 0).sum()) + int((true > 0).sum()))
