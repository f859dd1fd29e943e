"""Labels of windows become objects that keep their number, by the tracks that windows share."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from ifsvideo.types import BACKGROUND


@dataclass
class Linker:
    """Numbers for the objects of one window after another.

    A track belongs to the object to which most windows gave it: when two objects are taken for one in a
    window or two, each gets its number back.

    Attributes
    ----------
    least_shared : int
        Tracks that two labels must share to be one object.
    """

    least_shared: int
    _given: dict[int, Counter[int]] = field(default_factory=dict)
    _next: int = 1

    def number_of(self, track: int) -> int | None:
        """The object of a track, None where no window called it moving; of equal numbers the older."""
        given = self._given.get(track)
        return min(given, key=lambda number: (-given[number], number)) if given else None

    def link(self, ids: NDArray[np.int64], labels: NDArray[np.int64]) -> NDArray[np.int64]:
        """Replace the window's own labels by the clip's numbers.

        Each label above 0 takes the number with which it shares most tracks, one to one and so that most
        tracks in all keep theirs; what shares too few is new. Labels 0 and -1 stay.
        """
        here = [int(label) for label in np.unique(labels) if label > BACKGROUND]
        numbers = [self.number_of(int(i)) for i in ids]
        known = sorted({number for number in numbers if number is not None})
        shared = np.zeros((len(here), len(known)), dtype=np.int64)
        for number, label in zip(numbers, labels, strict=True):
            if number is not None and label > BACKGROUND:
                shared[here.index(int(label)), known.index(number)] += 1
        number_for: dict[int, int] = {}
        for row, column in zip(*linear_sum_assignment(-shared), strict=True):
            if shared[row, column] >= self.least_shared:
                number_for[here[row]] = known[column]
        for label in here:
            if label not in number_for:
                number_for[label] = self._next
                self._next += 1
        linked = np.array([number_for.get(int(label), int(label)) for label in labels], dtype=np.int64)
        for i, number in zip(ids, linked, strict=True):
            if number > BACKGROUND:
                self._given.setdefault(int(i), Counter())[int(number)] += 1
        return linked
