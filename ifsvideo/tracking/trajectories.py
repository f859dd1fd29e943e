"""The points of a whole clip, kept as rows so that memory follows what was seen, not frames x tracks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import FramePoints, Tracks


@dataclass(frozen=True)
class Trajectories:
    """Every observation of a clip, ordered by frame.

    Attributes
    ----------
    frame : (N,) int32
    ids : (N,) int64
    xy : (N, 2) float32, pixels
    frames : int
        Frames decoded.
    size : (width, height), pixels, or None where nobody told.
    fps : frames per second, or None where nobody told.
    """

    frame: NDArray[np.int32]
    ids: NDArray[np.int64]
    xy: NDArray[np.float32]
    frames: int
    size: tuple[int, int] | None = None
    fps: float | None = None

    @classmethod
    def collect(
        cls, points: Iterable[FramePoints], size: tuple[int, int] | None = None, fps: float | None = None
    ) -> Trajectories:
        """Gather what a tracker yields, one item per frame."""
        rows = list(points)
        if not rows:
            return cls(
                np.empty(0, np.int32), np.empty(0, np.int64), np.empty((0, 2), np.float32), 0, size, fps
            )
        counts = [len(row.ids) for row in rows]
        return cls(
            np.repeat(np.arange(len(rows), dtype=np.int32), counts),
            np.concatenate([row.ids for row in rows]).astype(np.int64),
            np.concatenate([row.xy for row in rows]).astype(np.float32),
            len(rows),
            size,
            fps,
        )

    @classmethod
    def from_tracks(cls, tracks: Tracks) -> Trajectories:
        """The same observations, from dense arrays."""
        frame, point = np.nonzero(tracks.visible)
        return cls(
            frame.astype(np.int32),
            tracks.ids[point],
            tracks.xy[frame, point].astype(np.float32),
            tracks.frames,
            tracks.size,
            tracks.fps,
        )

    def window(self, start: int, stop: int) -> Tracks:
        """Dense tracks of the frames start <= f < stop: every track seen at least once there."""
        first, last = np.searchsorted(self.frame, [start, stop])
        ids, column = np.unique(self.ids[first:last], return_inverse=True)
        row = self.frame[first:last] - start
        xy = np.full((stop - start, len(ids), 2), np.nan)
        visible = np.zeros(xy.shape[:2], dtype=bool)
        xy[row, column] = self.xy[first:last]
        visible[row, column] = True
        return Tracks(xy, visible, ids, self.size, self.fps)
