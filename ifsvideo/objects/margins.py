"""What is seen of an object's tracks shortly before it is known to move, and after.

Windows decide what moves, half a second at a time, and one in which little of it shows does not notice. So
an object is in sight earlier, and later, than its label tells; its tracks say since when.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import BACKGROUND, FramePoints, Scene

GAP_S = 0.5
"""Without its label for longer, seconds, an object was gone; shorter, its points were lost for a moment."""
MOST_S = 1.0
"""Longest margin, seconds: the length of a window. What stays in sight for longer stands still."""
_SEEN = 1 / 3
"""Share of the tracks that must be seen on; a few of the background are always among them."""
_LEAST_SEEN = 3
"""So many of them, if there are not fewer."""


@dataclass(frozen=True)
class Margin:
    """How an object's tracks go on beyond the first, or the last, frame in which it has its label.

    Attributes
    ----------
    frames : int
        How long they are seen there, without a gap; at most `MOST_S`.
    lasts : bool
        Whether that is all of `MOST_S`.
    shift : (2,) float64
        How far off they are in the end from where they were in that frame, pixels.
    passed : float
        Share of them that is another object's in the frame beyond it.
    """

    frames: int = 0
    lasts: bool = False
    shift: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    passed: float = 0.0


@dataclass(frozen=True)
class _Seen:
    """The points of a frame."""

    frame: int
    points: FramePoints
    labels: NDArray[np.int32]


class Margins:
    """Follows the tracks of objects beyond their labels.

    Parameters
    ----------
    fps : float

    Attributes
    ----------
    before, after : dict
        `Margin` by object and first, or last, frame of a sight. They are complete after `finish`.
    """

    def __init__(self, fps: float) -> None:
        self.before: dict[tuple[int, int], Margin] = {}
        self.after: dict[tuple[int, int], Margin] = {}
        self._gap = GAP_S * fps
        self._most = max(1, round(MOST_S * fps))
        self._frames: deque[_Seen] = deque(maxlen=2 * self._most + 1)
        self._last: dict[int, int] = {}
        self._begun: deque[tuple[int, int]] = deque()
        self._ended: deque[tuple[int, int]] = deque()

    def add(self, scene: Scene) -> None:
        """Take the next frame."""
        now = scene.frame
        self._frames.append(_Seen(now, FramePoints(scene.ids, scene.xy), scene.labels))
        for number in np.unique(scene.labels[scene.labels > BACKGROUND]).tolist():
            if number not in self._last:
                self._begun.append((number, now))
            self._last[number] = now
        for number, last in list(self._last.items()):
            if now - last > self._gap:
                self._ended.append((number, self._last.pop(number)))
        self._settle(now - self._most)

    def finish(self) -> None:
        """No frame will follow."""
        self._ended.extend(self._last.items())
        if self._frames:
            self._settle(self._frames[-1].frame)

    def _settle(self, latest: int) -> None:
        """Look at what began and ended up to a frame, so that enough is seen to either side."""
        while self._begun and self._begun[0][1] <= latest:
            number, first = self._begun.popleft()
            inside = [seen for seen in self._frames if first <= seen.frame < first + self._most]
            beyond = [seen for seen in reversed(self._frames) if seen.frame < first][: self._most]
            self.before[number, first] = self._margin(number, inside, beyond)
        while self._ended and self._ended[0][1] <= latest:
            number, last = self._ended.popleft()
            inside = [seen for seen in reversed(self._frames) if last - self._most < seen.frame <= last]
            beyond = [seen for seen in self._frames if seen.frame > last][: self._most]
            self.after[number, last] = self._margin(number, inside, beyond)

    def _margin(self, number: int, inside: Sequence[_Seen], beyond: Sequence[_Seen]) -> Margin:
        """Of the tracks that are the object's inside its sight; both lists begin next to its end."""
        own = np.unique(np.concatenate([seen.points.ids[seen.labels == number] for seen in inside]))
        places = inside[0].points.positions(own)
        count = int(np.isfinite(places).all(axis=1).sum())
        least = max(min(_LEAST_SEEN, count), _SEEN * count)
        frames, shift, passed = 0, np.zeros(2), 0.0
        for other in beyond:
            there = other.points.positions(own)
            step = there[np.isfinite(there).all(axis=1)] - places[np.isfinite(there).all(axis=1)]
            if len(step) < least:
                break
            if not frames:
                others = other.points.ids[(other.labels > BACKGROUND) & (other.labels != number)]
                passed = float(np.isin(own, others).sum() / len(step))
            frames = abs(other.frame - inside[0].frame)
            known = np.isfinite(step).all(axis=1)
            shift = np.median(step[known], axis=0).astype(np.float64) if known.any() else shift
        return Margin(frames, frames >= self._most, shift, passed)
