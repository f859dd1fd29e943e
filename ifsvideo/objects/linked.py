"""What a window says of the points of frames, once its objects are numbered."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.objects.windows import Bounds
from ifsvideo.ordered import places
from ifsvideo.types import BACKGROUND, UNDECIDED, Bools

_LEAST_AGREED = 20
"""Tracks of which two windows must agree to deny the one between, or what it found."""


@dataclass(frozen=True)
class LinkedWindow:
    """A window whose labels are the clip's numbers.

    Attributes
    ----------
    bounds : (first, one past the last) frame
    ids : (P,) int64, ordered
        Its tracks.
    labels : (P,) int64
        0 background, 1, 2, ... moving, -1 undecided.
    decided : (P,) bool
        Whether the window has decided of the track; the others follow their neighbours.
    """

    bounds: Bounds
    ids: NDArray[np.int64]
    labels: NDArray[np.int64]
    decided: Bools

    def say_of(
        self,
        ids: NDArray[np.int64],
        before: LinkedWindow | None = None,
        after: LinkedWindow | None = None,
    ) -> tuple[NDArray[np.int64], Bools]:
        """Labels of points (N,) by their tracks (N,), and whether these are but guessed.

        Windows overlap by half, so that those before and after see together what this one sees: where they
        agree whether a track moves, they outvote it. An object stands for half a window less often than a
        window takes it for the world, and all else for an object. Of an object most of whose tracks they take
        for background, the others, too, are what one of them says: a piece of ground that for once seems to
        move has tracks that only one of them sees.
        """
        labels, decided = self._find(ids)
        if before is not None and after is not None:
            agreed, first = _agreed(ids, before, after)
            outvoted = agreed & ((first > BACKGROUND) != (labels > BACKGROUND))
            denied = np.isin(labels, self._denied(before, after)) & ~agreed
            labels = np.where(outvoted, first, labels)
            if denied.any():
                labels[denied], decided[denied] = _said_by_either(ids[denied], before, after)
        return labels, ~decided

    def is_denied_by(self, before: LinkedWindow, after: LinkedWindow) -> bool:
        """Whether the windows before and after, where they agree, mostly say otherwise than this one.

        Such a window took a large object for the world, and the world for objects.
        """
        agreed, first = _agreed(self.ids, before, after)
        agreed &= self.decided
        wrong = agreed & ((first > BACKGROUND) != (self.labels > BACKGROUND))
        count = np.count_nonzero(agreed)
        return bool(count >= _LEAST_AGREED and 2 * np.count_nonzero(wrong) > count)

    def _denied(self, before: LinkedWindow, after: LinkedWindow) -> NDArray[np.int64]:
        """The objects (K,) most of whose tracks, of which the windows before and after agree, do not move."""
        agreed, first = _agreed(self.ids, before, after)
        agreed &= self.decided & (self.labels > BACKGROUND)
        count = np.bincount(self.labels[agreed])
        still = np.bincount(self.labels[agreed & (first == BACKGROUND)], minlength=len(count))
        return np.flatnonzero((count >= _LEAST_AGREED) & (2 * still > count))

    def _find(self, ids: NDArray[np.int64]) -> tuple[NDArray[np.int64], Bools]:
        """Labels (N,) of tracks, -1 of those that the window has not, and whether it has decided of them."""
        place, known = places(ids, self.ids)
        place = place[known]
        labels, decided = np.full(len(ids), UNDECIDED, dtype=np.int64), np.zeros(len(ids), dtype=bool)
        labels[known], decided[known] = self.labels[place], self.decided[place]
        return labels, decided


def _agreed(
    ids: NDArray[np.int64], before: LinkedWindow, after: LinkedWindow
) -> tuple[Bools, NDArray[np.int64]]:
    """Of which tracks (N,) two windows have decided, and alike, and what (N,)."""
    first, was_decided = before._find(ids)
    second, is_decided = after._find(ids)
    return (first == second) & (first != UNDECIDED) & was_decided & is_decided, first


def _said_by_either(
    ids: NDArray[np.int64], before: LinkedWindow, after: LinkedWindow
) -> tuple[NDArray[np.int64], Bools]:
    """Labels (N,) of tracks by that of two windows which has decided of them, or else has them, by the one
    before if both; and whether it has decided."""
    first, was_decided = before._find(ids)
    second, is_decided = after._find(ids)
    by_first = was_decided | (~is_decided & (first != UNDECIDED))
    return np.where(by_first, first, second), was_decided | is_decided
