"""Looks vote whether a track lies on an object."""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import BACKGROUND, Bools, Ints

_LEAVES, _SURE_LEAVES = 1, 2
"""Looks by which a track must have lain beside its object more often than on it: one that is guessed to be
the object's, and one of which a window has decided."""
_JOINS, _SURE_JOINS = 1, 2
"""Looks by which a track of the background must have lain on an object more often than beside it: one that is
guessed to be background, and one of which a window has decided."""
_TOLD = 3
"""Looks by which more must have said the one than the other, until a track is told."""
_SLOW = 20.0
"""Frames a second below which it takes one look more to leave: pictures that are a tenth of a second apart
differ by more than two motions. Without this a fiftieth of what moves in KT3DMoSeg goes to the background."""


class Votes:
    """Of each track and object: looks in which the track lay there, less those in which it did not.

    Parameters
    ----------
    fps : float
        Frames a second.
    """

    def __init__(self, fps: float) -> None:
        self._patience = int(fps < _SLOW)
        self._votes: dict[int, Counter[int]] = {}
        self._decided: set[int] = set()

    def decide(self, tracks: NDArray[np.int64]) -> None:
        """Some tracks (T,) have been decided by a window to be an object's: they do not leave so easily."""
        self._decided.update(tracks.tolist())

    def cast(self, tracks: NDArray[np.int64], number: int, lies_there: Bools) -> None:
        """Count one look at an object: whether each of some tracks (T,) lies on it (T,)."""
        for track, lies in zip(tracks.tolist(), lies_there.tolist(), strict=True):
            self._votes.setdefault(track, Counter())[number] += 1 if lies else -1

    def deny(self, tracks: NDArray[np.int64], number: int) -> None:
        """Some tracks (T,) cannot lie on an object, whatever was seen before."""
        for track in tracks.tolist():
            votes = self._votes.setdefault(track, Counter())
            votes[number] = min(votes[number], 0) - 1

    def told(self, tracks: NDArray[np.int64], number: int) -> Bools:
        """Whether looks at an object have told (T,) of some tracks (T,) whether they lie on it: one more
        changes nothing, but for a decided track that has just left at a low rate."""
        votes = [self._votes[track][number] if track in self._votes else 0 for track in tracks.tolist()]
        return np.asarray(np.abs(np.array(votes, int)) >= _TOLD, bool)

    def joined(self, ids: NDArray[np.int64], labels: Ints, guessed: Bools) -> NDArray[np.int64]:
        """Labels (N,) of observations, of which those of the background that lay on an object are its own.

        Parameters
        ----------
        ids : (N,) int64
            Their tracks.
        labels : (N,) int
        guessed : (N,) bool
            Which labels are but guesses.
        """
        result = labels.astype(np.int64)
        rows = self._asked(ids, (labels == BACKGROUND) | (guessed & (labels < BACKGROUND)))
        # A track is asked once, in however many frames it is seen.
        tracks, place = np.unique(ids[rows], return_inverse=True)
        most = [self._votes[track].most_common(1)[0] for track in tracks.tolist()]
        number, vote = np.array(most, np.int64).reshape(-1, 2).T[:, place]
        joins = vote >= np.where(guessed[rows], _JOINS, _SURE_JOINS)
        result[rows[joins]] = number[joins]
        return result

    def corrected(self, ids: NDArray[np.int64], labels: Ints, guessed: Bools) -> NDArray[np.int64]:
        """Labels (N,) of observations by all looks so far, as of `joined`; what lay beside its object is
        background."""
        result = self.joined(ids, labels, guessed)
        rows = self._asked(ids, labels > BACKGROUND)
        # Pairs of a track and an object as one number each: numpy sorts these ten times as fast.
        objects = int(labels.max(initial=0)) + 1
        pairs, place = np.unique(ids[rows] * objects + labels[rows], return_inverse=True)
        leaves = np.array([self._leaves(*divmod(pair, objects)) for pair in pairs.tolist()], bool)
        result[rows[leaves[place]]] = BACKGROUND
        return result

    def _leaves(self, track: int, number: int) -> bool:
        """Whether a track has lain beside its object in more looks than it takes to leave."""
        needed = self._patience + (_SURE_LEAVES if track in self._decided else _LEAVES)
        return self._votes[track][number] <= -needed

    def _asked(self, ids: NDArray[np.int64], which: Bools) -> NDArray[np.intp]:
        """Those (K,) of some observations of whose tracks there are votes."""
        known = np.fromiter(self._votes, np.int64, len(self._votes))
        rows = np.flatnonzero(which)
        return rows[np.isin(ids[rows], known)]

    def forget(self, gone: NDArray[np.int64]) -> None:
        """Drop what is known of some tracks (T,) that have ended; one that comes again is a new one."""
        for track in gone.tolist():
            self._votes.pop(track, None)
            self._decided.discard(track)
