"""Labels of windows become objects that keep their number, by the tracks that windows share."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ifsvideo.types import BACKGROUND


@dataclass
class Linker:
    """Numbers for the objects of one window after another.

    A track belongs to the object to which most windows gave it. Two objects that were told apart before are
    not made one by a window that takes them for one, because they pass each other or move alike for a second:
    its tracks keep their numbers, and new ones take that of the nearest.

    Attributes
    ----------
    least_shared : int
        Tracks that two labels must share to be one object.
    least_windows : int
        Windows in which an object was found before it is kept apart from another that it is taken for.
    """

    least_shared: int
    least_windows: int = 2
    _given: dict[int, Counter[int]] = field(default_factory=dict)
    _windows: Counter[int] = field(default_factory=Counter)
    _next: int = 1

    def number_of(self, track: int) -> int | None:
        """The object of a track, None where no window called it moving; of equal numbers the older."""
        given = self._given.get(track)
        return min(given, key=lambda number: (-given[number], number)) if given else None

    def link(
        self, ids: NDArray[np.int64], labels: NDArray[np.int64], place: NDArray[np.float64]
    ) -> NDArray[np.int64]:
        """Replace the window's own labels by the clip's numbers.

        Each label above 0 takes the number with which it shares most tracks, one to one and so that most
        tracks in all keep theirs; what shares too few is new. Labels 0 and -1 stay.

        Parameters
        ----------
        ids, labels : (N,) int
        place : (N, 2) float
            Where the tracks are in this window, pixels.
        """
        here = [int(label) for label in np.unique(labels) if label > BACKGROUND]
        numbers = np.array([self.number_of(int(i)) or 0 for i in ids], dtype=np.int64)
        known = np.unique(numbers[numbers > 0]).tolist()
        shared = np.array(
            [[np.count_nonzero((labels == label) & (numbers == n)) for n in known] for label in here]
        ).reshape(len(here), len(known))
        number_for: dict[int, int] = {}
        for row, column in zip(*linear_sum_assignment(-shared), strict=True):
            if shared[row, column] >= self.least_shared:
                number_for[here[row]] = known[column]
        linked = labels.astype(np.int64)
        for label in here:
            if label not in number_for:
                number_for[label] = self._next
                self._next += 1
            members = np.flatnonzero(labels == label)
            linked[members] = number_for[label]
            self._keep_apart(linked, members, numbers[members], place)
        for i, number in zip(ids, linked, strict=True):
            if number > BACKGROUND:
                self._given.setdefault(int(i), Counter())[int(number)] += 1
        self._windows.update(np.unique(linked[linked > BACKGROUND]).tolist())
        return linked

    def _keep_apart(
        self,
        linked: NDArray[np.int64],
        members: NDArray[np.int64],
        numbers: NDArray[np.int64],
        place: NDArray[np.float64],
    ) -> None:
        """Share out the members of a label that holds two or more objects that were known apart."""
        held = [
            number
            for number, count in Counter(numbers[numbers > 0].tolist()).items()
            if count >= self.least_shared and self._windows[number] >= self.least_windows
        ]
        if len(held) < 2:
            return
        certain = np.isin(numbers, held)
        _, nearest = cKDTree(place[members[certain]]).query(place[members])
        linked[members] = numbers[certain][nearest]
