"""Points fixed to the camera: bonnet, windscreen reflections, burnt-in time and logos."""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ifsvideo.config import ObjectsConfig
from ifsvideo.ordered import places
from ifsvideo.types import Bools, FramePoints

SHAKE_TO_SPREAD = 6.0
"""How many times the track's own spread the world must have shaken meanwhile."""
_GRID = 8
"""Cells along a side of the picture; the world must be seen in many of them."""
_LOOKED_AT = 80
"""Frames of the memory in which tracks are looked at; more of them tell no more."""
_LEAST_MEMORY = 128
"""Fewest frames of it: more than come between two updates."""
_LEAST_LOOKS = 3
"""Frames in which a track must have been looked at."""


class CameraFixed:
    """Finds the tracks that stay put while the world is seen both to move and to shake.

    A distant point straight ahead stays put too while the camera drives at it, but not when the camera
    pitches and yaws: so a track counts as fixed only if the common motion of all other points, summed over
    its life, left the place by several times what the track itself did. Where most of the picture stays put,
    the camera stands still and nothing is fixed to it.

    Of the past as much is kept as ``config.fixed_memory_s`` says. Once fixed, a track stays so while it
    stays put: a far point can seem fixed for a second, until it is near enough to go.

    Parameters
    ----------
    size : (width, height) of the picture, pixels, or None where nobody told.
    fps : float or None
    config : ObjectsConfig
    """

    def __init__(self, size: tuple[int, int] | None, fps: float | None, config: ObjectsConfig) -> None:
        memory = max(_LEAST_MEMORY, round(config.fixed_memory_s * (fps or 30.0)))
        self._size = size
        self._config = config
        self._every = math.ceil(memory / _LOOKED_AT)
        self._frames: deque[FramePoints] = deque(maxlen=memory)
        self._common: deque[NDArray[np.float64]] = deque(maxlen=memory)
        self._lengths: deque[float] = deque(maxlen=memory)
        self._new = 0
        self.ids = np.empty(0, np.int64)
        """(T,) int64, ordered: the tracks known to be fixed, as of the last `update`."""

    def add(self, points: FramePoints) -> None:
        """Take the points of the next frame, ordered by id."""
        self._frames.append(points)
        self._new += 1

    def update(self) -> None:
        """Look at the tracks seen since the last update."""
        recent = list(self._frames)[-self._new :]
        if not recent:
            return
        ids = np.unique(np.concatenate([frame.ids for frame in recent]))
        looks = list(self._frames)[:: self._every]
        xy = np.asarray(np.stack([frame.positions(ids) for frame in looks]), np.float32)
        count = np.isfinite(xy[:, :, 0]).sum(axis=0)
        unit = self._unit(recent)
        bound = self._config.fixed_spread * unit
        first, last = _ends(xy)
        gone = np.linalg.norm(last - first, axis=1)
        spread = np.full(len(ids), np.inf)
        near = np.flatnonzero((gone <= 4 * bound) & (count >= _LEAST_LOOKS))
        spread[near] = _spread(xy[:, near], count[near])
        still, moving = spread < bound, (spread >= bound) & (gone > 4 * bound)
        self.ids = np.setdiff1d(self.ids, ids[spread >= bound], assume_unique=True)
        # Of what has ended nobody asks any more once it is out of memory.
        seen = [places(self.ids, frame.ids)[1] for frame in looks]
        self.ids = self.ids[np.any(seen, axis=0)]
        self._follow_world(ids, still, moving)
        self._judge(ids[still], spread[still], xy[:, still], unit)

    def _judge(
        self,
        ids: NDArray[np.int64],
        spread: NDArray[np.float64],
        xy: NDArray[np.float32],
        unit: float,
    ) -> None:
        """Which of the tracks that stay put are fixed."""
        config = self._config
        path = np.cumsum(np.vstack([np.zeros((1, 2)), *self._common]), axis=0)
        travelled = np.concatenate([[0.0], np.cumsum(self._lengths)])
        # Frame f of the memory is path[f]: as many steps as frames were kept before the first of all came.
        path, travelled = path[-len(self._frames) :], travelled[-len(self._frames) :]
        if not len(ids) or travelled[-1] - travelled[0] <= config.fixed_travel * unit:
            return
        seen = np.isfinite(xy[:, :, 0])
        begin = np.argmax(seen, axis=0) * self._every
        end = (len(seen) - 1 - np.argmax(seen[::-1], axis=0)) * self._every
        found = []
        for k in np.flatnonzero(~np.isin(ids, self.ids, assume_unique=True)):
            shake = np.linalg.norm(np.ptp(path[begin[k] : end[k] + 1], axis=0))
            enough = max(config.fixed_shake * unit, SHAKE_TO_SPREAD * spread[k])
            if shake > enough and travelled[end[k]] - travelled[begin[k]] > config.fixed_travel * unit:
                found.append(ids[k])
        self.ids = np.union1d(self.ids, np.array(found, np.int64))

    def _follow_world(self, ids: NDArray[np.int64], still: Bools, moving: Bools) -> None:
        """Median step of the moving points, and median length of their steps, for every new frame; of each of
        some tracks, ordered, whether it stays or moves.

        Both are zero in frames in which such points own a small part of the picture only: they are movers
        then, before a camera that stands still.
        """
        frames = list(self._frames)[-self._new - 1 :]
        self._new = 0
        for before, after in pairwise(frames):
            there = after.positions(before.ids)
            place, known = places(before.ids, ids)
            known &= np.isfinite(there[:, 0])
            place = place[known]
            step, xy, goes = (there - before.xy)[known], before.xy[known], moving[place]
            counted = goes | still[place]
            step, xy, goes = step[counted], xy[counted], goes[counted]
            if goes.any() and self._share_owned(xy, goes) >= self._config.fixed_world_share:
                self._common.append(np.median(step[goes], axis=0).astype(np.float64))
                self._lengths.append(float(np.median(np.linalg.norm(step[goes], axis=1))))
            else:
                self._common.append(np.zeros(2))
                self._lengths.append(0.0)

    def _share_owned(self, xy: NDArray[np.float32], goes: Bools) -> float:
        """Share of the cells with points in which most of them go."""
        extent = np.asarray(self._size or np.ptp(xy, axis=0).tolist(), dtype=np.float64) + 1
        cell = np.clip((xy / extent * _GRID).astype(int), 0, _GRID - 1) @ [1, _GRID]
        seen = np.bincount(cell, minlength=_GRID**2)
        going = np.bincount(cell[goes], minlength=_GRID**2)
        return int(np.count_nonzero(2 * going > seen)) / max(int(np.count_nonzero(seen)), 1)

    def _unit(self, recent: list[FramePoints]) -> float:
        """Pixels per pixel of a 640x480 picture."""
        if self._size:
            return float(max(np.hypot(*self._size), 1.0)) / 800
        xy = np.concatenate([frame.xy for frame in recent])
        return float(max(np.hypot(*np.ptp(xy, axis=0)), 1.0)) / 800 if len(xy) else 1.0


def _ends(xy: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """First and last position (N, 2) of each track of (L, N, 2); NaN where there is none."""
    seen = np.isfinite(xy[:, :, 0])
    column = np.arange(xy.shape[1])
    return xy[np.argmax(seen, axis=0), column], xy[len(xy) - 1 - np.argmax(seen[::-1], axis=0), column]


def _spread(xy: NDArray[np.float32], count: NDArray[np.int64]) -> NDArray[np.float64]:
    """Radius (N,) round each track's median position that holds nine tenths of (L, N, 2), NaN left out."""
    column = np.arange(xy.shape[1])
    middle = np.sort(xy, axis=0)[(count - 1) // 2, column]  # sorting puts NaN last
    distance = np.sort(np.linalg.norm(xy - middle, axis=2), axis=0)
    return np.asarray(distance[np.ceil(0.9 * (count - 1)).astype(int), column], np.float64)
