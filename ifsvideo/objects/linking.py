"""Labels of windows become objects that keep their number, by the tracks that windows share."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.special import expit, logit

from ifsvideo.objects.reappearance import Sight, match
from ifsvideo.types import BACKGROUND, Bools, Tracks

_SUREST = 1 - 1e-9
"""Confidence that is as good as 1: another window's doubt counts beside it, too."""


@dataclass
class Linker:
    """Numbers for the objects of one window after another.

    A track belongs to the object to which most windows gave it. Each label of a window takes the number with
    which it shares most tracks, one to one, so that most tracks in all keep theirs:

    - Only tracks of which both windows could decide count at first. A label that shares some of these with a
      number, but too few, takes it if the others agree, which but follow their neighbours.
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
    _guessed: dict[int, Counter[int]] = field(default_factory=dict)
    _windows: Counter[int] = field(default_factory=Counter)
    _surest: dict[int, list[float]] = field(default_factory=dict)
    _sights: dict[int, Sight] = field(default_factory=dict)
    _next: int = 1

    def number_of(self, track: int) -> int | None:
        """The object of a track, None where no window called it moving; of equal numbers the older.

        What its neighbours were counts where no window could decide.
        """
        given = self._given.get(track) or self._guessed.get(track)
        return min(given, key=lambda number: (-given[number], number)) if given else None

    def movers(self) -> NDArray[np.int64]:
        """Tracks (T,) that windows called moving and could decide of."""
        return np.fromiter(self._given, np.int64, len(self._given))

    def surest(self, number: int, windows: int = 1) -> float:
        """How sure of an object so many of the surest windows were, 0 to 1: by the mean of their log odds, 0
        where fewer found it; at most `least_windows`."""
        surest = self._surest.get(number, [])[:windows]
        return float(expit(np.mean(logit(surest)))) if len(surest) == windows else 0.0

    def forget(self, gone: NDArray[np.int64]) -> None:
        """Drop what is known of some tracks (T,) that have ended; one that comes again is a new one."""
        for track in gone.tolist():
            self._given.pop(track, None)
            self._guessed.pop(track, None)

    def link(
        self,
        tracks: Tracks,
        labels: NDArray[np.int64],
        decided: Bools | None = None,
        confidence: NDArray[np.float64] | None = None,
        *,
        start: int = 0,
        stride: int = 1,
    ) -> NDArray[np.int64]:
        """Replace the window's own labels by the clip's numbers. Labels 0 and -1 stay.

        Parameters
        ----------
        tracks : Tracks
            Of the window.
        labels : (P,) int
        decided : (P,) bool, optional
            Whether the window has decided of the track; the others follow their neighbours, and are no
            evidence of what is one object. By default it has of all.
        confidence : (P,) float, optional
            How sure the window is of each label, 0 to 1; of all unless told.
        start : int
            Frame of the clip with which the window begins.
        stride : int
            Frames of the clip from one of the window's to the next.
        """
        here = [int(label) for label in np.unique(labels) if label > BACKGROUND]
        every = np.array([self.number_of(i) or 0 for i in tracks.ids.tolist()], dtype=np.int64)
        numbers = np.where(np.isin(tracks.ids, self.movers()), every, 0)
        sure = np.ones(len(labels), bool) if decided is None else decided
        number_for = self._by_shared_tracks(here, labels[sure], numbers[sure])
        others = [label for label in here if label not in number_for]
        every[np.isin(every, list(number_for.values()))] = 0
        number_for |= self._by_shared_tracks(
            others, labels, _told_by_all(every, labels, np.where(sure, numbers, 0))
        )
        sights = {label: Sight.of(tracks, labels == label, start, stride) for label in here}
        unknown = {label: sights[label] for label in here if label not in number_for}
        taken = number_for.values()
        lost = {
            number: replace(
                sight, last=max(sight.last, self._last_seen(tracks, numbers == number, start, stride))
            )
            for number, sight in self._sights.items()
            if number not in taken
        }
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
        for k in np.flatnonzero(linked > BACKGROUND).tolist():
            evidence = self._given if sure[k] else self._guessed
            evidence.setdefault(int(tracks.ids[k]), Counter())[int(linked[k])] += 1
        for number in np.unique(linked[linked > BACKGROUND]).tolist():
            self._windows[number] += 1
            sure_here = 1.0 if confidence is None else float(confidence[linked == number].max())
            surest = [*self._surest.get(number, []), min(max(sure_here, 1 - _SUREST), _SUREST)]
            self._surest[number] = sorted(surest, reverse=True)[: max(1, self.least_windows)]
        self._sights |= lost | {number_for[label]: sight for label, sight in sights.items()}
        self._sights = {n: s for n, s in self._sights.items() if start - s.last <= self.longest_loss}
        return linked

    def _last_seen(self, tracks: Tracks, own: Bools, start: int, stride: int) -> float:
        """Last frame in which an object's tracks are seen in a window, though it may not find the object."""
        seen = np.flatnonzero(tracks.visible[:, own].sum(axis=1) >= self.least_shared)
        return float(start + stride * seen[-1]) if len(seen) else -np.inf

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


def _told_by_all(
    every: NDArray[np.int64], labels: NDArray[np.int64], firm: NDArray[np.int64]
) -> NDArray[np.int64]:
    """The numbers (P,) of those objects most of whose tracks a window gives to one label; most tracks of that
    label, of those that have a number, must have theirs, one of them ``firm``ly (P,). Else 0."""
    result = np.zeros_like(every)
    for number in np.unique(every[every > 0]).tolist():
        said = labels[(every == number) & (labels >= BACKGROUND)]
        for label, count in Counter(said.tolist()).most_common(1):
            its = labels == label
            alone = 2 * count > len(said) and 2 * count > np.count_nonzero(its & (every > 0))
            if label > BACKGROUND and alone and (firm[its] == number).any():
                result[every == number] = number
    return result
