"""Which objects of a clip count, and their final numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import BACKGROUND, Ints


class Numbers:
    """Final numbers of objects: 1, 2, ... in the order in which they appear, none used twice.

    Parameters
    ----------
    following : iterator of int
        The numbers to be given; several `Numbers` may share it.
    least_frames : float
        Frames from first to last sight below which there is no object.
    """

    def __init__(self, following: Iterator[int], least_frames: float) -> None:
        self._following = following
        self._least_frames = least_frames
        self._final: dict[int, int] = {}

    def settle(
        self,
        labels: Sequence[Ints],
        places: Sequence[int],
        final: int,
    ) -> list[NDArray[np.int32]]:
        """Labels that will not change any more, of the first frames of those that are known.

        An object without a number gets one if it is seen for long enough in all these frames together; its
        points go to the background until then.

        Parameters
        ----------
        labels : sequence of (N,) int
            Of each frame, any numbers above 0 for objects.
        places : sequence of int
            When each frame is shown, frames from the clip's first.
        final : int
            How many frames, the first ones, are wanted.
        """
        first: dict[int, int] = {}
        last: dict[int, int] = {}
        for own, place in zip(labels, places, strict=True):
            for number in np.unique(own[own > BACKGROUND]).tolist():
                first.setdefault(number, place)
                last[number] = place
        new = [number for number in first if number not in self._final]
        wanted = set(np.unique(np.concatenate([*labels[:final], []])).tolist())
        for number in sorted(new, key=lambda number: (first[number], number)):
            if number in wanted and last[number] - first[number] + 1 >= self._least_frames:
                self._final[number] = next(self._following)
        return [self._renamed(own) for own in labels[:final]]

    def _renamed(self, labels: Ints) -> NDArray[np.int32]:
        names, place = np.unique(labels, return_inverse=True)
        renamed = [
            name if name <= BACKGROUND else self._final.get(name, BACKGROUND) for name in names.tolist()
        ]
        return np.array(renamed, dtype=np.int32)[place]
