"""What the sinks are told of each frame, with the way its points came."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

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
        self._frame = 0

    def next(self, points: FramePoints, labels: NDArray[np.int32]) -> Scene:
        """The scene of the next frame; its points are ordered by id."""
        self._past.append(points)
        trails = np.stack([earlier.positions(points.ids) for earlier in self._past])
        time_s = self._info.time_of(self._frame)
        scene = Scene(self._frame, time_s, points.ids, points.xy, labels, trails)
        self._frame += 1
        return scene
