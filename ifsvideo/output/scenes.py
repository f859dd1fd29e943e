"""What the sinks are told of each frame, with the way its points came."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from ifsvideo.ordered import places
from ifsvideo.types import FramePoints, Scene, VideoInfo


class Scenes:
    """The scenes of a clip, one frame after another; only as much of the past is kept as the trails show.

    Parameters
    ----------
    info : VideoInfo
        Tells the time of a frame.
    trail_s : float
        Length of the trails, seconds.
    """

    def __init__(self, info: VideoInfo, trail_s: float) -> None:
        self._info = info
        trail = 1 + max(0, round(trail_s * float(info.fps)))
        nothing = FramePoints(np.empty(0, np.int64), np.empty((0, 2), np.float32))
        self._past: deque[FramePoints] = deque([nothing] * trail, maxlen=trail)
        self._trails = np.empty((trail, 0, 2), np.float32)
        self._largest_id = -1
        self._frame = 0

    def next(self, points: FramePoints, labels: NDArray[np.int32]) -> Scene:
        """The scene of the next frame; its points are ordered by id."""
        self._trails = self._continued(points)
        self._trails.flags.writeable = False  # the next scene goes on with them, whatever a renderer does
        self._past.append(points)
        if len(points.ids):
            self._largest_id = max(self._largest_id, int(points.ids[-1]))
        time_s = self._info.time_of(self._frame)
        scene = Scene(self._frame, time_s, points.ids, points.xy, labels, self._trails)
        self._frame += 1
        return scene

    def _continued(self, points: FramePoints) -> NDArray[np.float32]:
        """The trails (T, N, 2) of these points: those of the frame before, where they were seen in it."""
        trails = np.full((len(self._past), len(points.ids), 2), np.nan, np.float32)
        trails[-1] = points.xy
        if len(trails) == 1:
            return trails
        place, went_on = places(points.ids, self._past[-1].ids)
        trails[:-1, went_on] = self._trails[1:, place[went_on]]
        back = (points.ids <= self._largest_id) & ~went_on
        if back.any():  # seen earlier, but not in the frame before
            for positions, earlier in zip(trails[:-1], list(self._past)[1:], strict=True):
                positions[back] = earlier.positions(points.ids[back])
        return trails
