"""What the tracks of an object did before it was seen to move, and what they do after."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import BACKGROUND, Scene

_LATER_S = 0.5
"""How long before, or after, an object's tracks are looked for on the background, seconds: as long as an
object must last to be one."""


class Standing:
    """Tells whether an object that comes up, or goes, was or is the background's all along.

    Parameters
    ----------
    fps : float

    Attributes
    ----------
    before : dict
        By object and frame of a first sight: share of its tracks that were the background's, half a second
        earlier.
    after : dict
        By object and frame of a last sight: share of its tracks that are, half a second later.
    """

    def __init__(self, fps: float) -> None:
        self.before: dict[tuple[int, int], float] = {}
        self.after: dict[tuple[int, int], float] = {}
        self._later = max(1, round(_LATER_S * fps))
        self._ground: deque[NDArray[np.int64]] = deque(maxlen=self._later)
        self._last: dict[int, tuple[int, NDArray[np.int64]]] = {}

    def add(self, scene: Scene) -> None:
        """Take the next frame."""
        ground = scene.ids[scene.labels == BACKGROUND]
        for number in np.unique(scene.labels[scene.labels > BACKGROUND]).tolist():
            ids = scene.ids[scene.labels == number]
            if number not in self._last and len(self._ground) == self._later:
                self.before[number, scene.frame] = _share(ids, self._ground[0])
            self._last[number] = scene.frame, ids
        for number, (frame, ids) in list(self._last.items()):
            if scene.frame - frame >= self._later:
                self.after[number, frame] = _share(ids, ground)
                del self._last[number]
        self._ground.append(ground)


def _share(ids: NDArray[np.int64], among: NDArray[np.int64]) -> float:
    return float(np.isin(ids, among).mean())
