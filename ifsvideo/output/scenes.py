"""What the renderer is told of each frame, taken from the table of labels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import LabelTable, Scene, VideoInfo


class Scenes:
    """The scenes of a clip.

    Parameters
    ----------
    table : LabelTable
        Ordered by frame, then track.
    info : VideoInfo
    trail_s : float
        Length of the trails, seconds.
    """

    def __init__(self, table: LabelTable, info: VideoInfo, trail_s: float) -> None:
        self._table = table
        self._info = info
        self._trail = 1 + max(0, round(trail_s * float(info.fps)))

    def at(self, frame: int) -> Scene:
        """The scene of one frame, from 0."""
        rows = self._table.at(frame)
        ids = self._table.ids[rows]
        past = range(frame - self._trail + 1, frame + 1)
        trails = np.stack([self._position(ids, earlier) for earlier in past])
        xy, labels = self._table.xy[rows], self._table.labels[rows]
        return Scene(frame, self._info.time_of(frame), ids, xy, labels, trails)

    def _position(self, ids: NDArray[np.int64], frame: int) -> NDArray[np.float32]:
        """Where these tracks were in a frame, (N, 2); NaN where they were not seen."""
        found = np.full((len(ids), 2), np.nan, dtype=np.float32)
        rows = self._table.at(frame)
        there = self._table.ids[rows]
        if len(there):
            place = np.minimum(np.searchsorted(there, ids), len(there) - 1)
            same = there[place] == ids
            found[same] = self._table.xy[rows][place[same]]
        return found
