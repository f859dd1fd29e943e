"""Labels of windows become objects that keep their number, by the tracks that windows share."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ifsvideo.objects.reappearance import Sight, match
from ifsvideo.types import BACKGROUND, Tracks


@dataclass
class Linker:
    """Numbers for the objects of one window after another.

    A track belongs to the object to which most windows gave it. Each label of a window takes the number with
    which it shares most tracks, one to one, so that most tracks in all keep theirs:

    - Birth: a label that shares too few tracks is a new object, or one that was lost a moment ago, if place
      and motion agree (`ifsvideo.objects.reappearance`).
    - Death: an object that no window finds for ``longest_loss`` frames does not come back; its number is
      not used again.
    - Split: the part that shares most tracks keeps the number, the other is a new object.
    - Merger: two objects that were told apart before are not made one by a window that takes them for one,
      because they pass each other or move alike for a second: its tracks keep their numbers, and new ones
      take that of the nearest. Else the number with most tracks stays.

    Attributes
    ----------
    least_shared : int
        Tracks that two labels must share to be one object.
    least_windows : int
        Windows in which an object was found before it is kept apart from another that it is taken for.
    longest_loss : float
        Frames for which an object may be lost and still be the same.
    """

    least_shared: int
    least_windows: int = 2
    longest_loss: float = 0.0
    _given: dict[int, Counter[int]] = field(default_factory=dict)
    _windows: Counter[int] = field(default_factory=Counter)
    _sights: dict[int, Sight] = field(default_factory=dict)
    _next: int = 1

    def number_of(self, track: int) -> int | None:
        """The object of a track, None where no window called it moving; of equal numbers the older."""
        given = self._given.get(track)
        return min(given, key=lambda number: (-given[number], number)) if given else None

    def windows_of(self, number: int) -> int:
        """Number of windows in which an object was found."""
        return self._windows[number]

    def forget(self, alive: NDArray[np.int64]) -> None:
        """Drop what is known of all other tracks: they will not come again."""
        for track in self._given.keys() - set(alive.tolist()):
            del self._given[track]

    def link(
        self, tracks: Tracks, labels: NDArray[np.int64], start: int = 0, stride: int = 1
    ) -> NDArray[np.int64]:
        """Replace the window's own labels by the clip's numbers. Labels 0 and -1 stay.

        Parameters
        ----------
        tracks : Tracks
            Of the window.
        labels : (P,) int
        start : int
            Frame of the clip with which the window begins.
        stride : int
            Frames of the clip from one of the window's to the next.
        """
        here = [int(label) for label in np.unique(labels) if label > BACKGROUND]
        numbers = np.array([self.number_of(int(i)) or 0 for i in tracks.ids], dtype=np.int64)
        number_for = self._by_shared_tracks(here, labels, numbers)
        sights = {label: Sight.of(tracks, labels == label, start, stride) for label in here}
        unknown = {label: sights[label] for label in here if label not in number_for}
        taken = number_for.values()
        lost = {number: sight for number, sight in self._sights.items() if number not in taken}
        unit = float(np.hypot(*tracks.size)) / 800 if tracks.size else 1.0
        number_for |= match(lost, unknown, self.longest_loss, unit)
        linked = labels.astype(np.int64)
        place = np.nanmean(tracks.xy, axis=0)
        for label in here:
            if label not in number_for:
                number_for[label] = self._next
                self._next += 1
            members = np.flatnonzero(labels == label)
            linked[members] = number_for[label]
            self._keep_apart(linked, members, numbers[members], place)
        for i, number in zip(tracks.ids.tolist(), linked.tolist(), strict=True):
            if number > BACKGROUND:
                self._given.setdefault(i, Counter())[number] += 1
        self._windows.update(np.unique(linked[linked > BACKGROUND]).tolist())
        self._sights |= {number_for[label]: sight for label, sight in sights.items()}
        self._sights = {n: s for n, s in self._sights.items() if start - s.last <= self.longest_loss}
        return linked

    def _by_shared_tracks(
        self, here: list[int], labels: NDArray[np.int64], numbers: NDArray[np.int64]
    ) -> dict[int, int]:
        """The number of each label that shares enough tracks with one."""
        known = np.unique(numbers[numbers > 0]).tolist()
        shared = np.array(
            [[np.count_nonzero((labels == label) & (numbers == n)) for n in known] for label in here]
        ).reshape(len(here), len(known))
        pairs = zip(*linear_sum_assignment(-shared), strict=True)
        return {here[row]: known[column] for row, column in pairs if shared[row, column] >= self.least_shared}

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
