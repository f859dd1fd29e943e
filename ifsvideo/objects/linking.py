"""Labels of windows become objects that keep their number, by the tracks that windows share."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from ifsvideo.types import BACKGROUND


@dataclass
class Linker:
    """Numbers for the objects of one window after another.

    Attributes
    ----------
    least_shared : int
        Tracks that two labels must share to be one object.
    """

    least_shared: int
    _number_of: dict[int, int] = field(default_factory=dict)
    _next: int = 1

    def link(self, ids: NDArray[np.int64], labels: NDArray[np.int64]) -> NDArray[np.int64]:
        """Replace the window's own labels by the clip's numbers.

        Each label above 0 takes the number with which it shares most tracks, one to one and so that most
        tracks in all keep theirs; what shares too few is new. Labels 0 and -1 stay.
        """
        here = [int(label) for label in np.unique(labels) if label > BACKGROUND]
        known = sorted({self._number_of[int(i)] for i in ids if int(i) in self._number_of})
        shared = np.zeros((len(here), len(known)), dtype=np.int64)
        for i, label in zip(ids, labels, strict=True):
            number = self._number_of.get(int(i))
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
                self._number_of[int(i)] = int(number)
        return linked
