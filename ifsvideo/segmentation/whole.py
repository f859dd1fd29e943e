"""What the trajectories as a whole tell of a segmentation: a second opinion, by other means.

Segments are sampled in small disks and merged pair by pair, and runs that begin with other samples are wrong
together where a pair deceives. A cut of all trajectories at once (`ifsvideo.segmentation.shape_interaction`)
has other faults: it believes in an affine camera, and cannot tell how many motions there are. What both find
is hardly ever wrong.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation.key_frames import key_frames
from ifsvideo.segmentation.lowrank import Subspace, trajectory_matrix
from ifsvideo.segmentation.shape_interaction import AFFINE_RANK, Cut, ShapeInteraction, coordinates
from ifsvideo.segmentation.smoothing import without_gaps
from ifsvideo.types import Tracks

_KEY_FRAMES = 30
"""Frames that are looked at: of 12 the cuts of Hopkins-155 are as good, but not where tracks are noisy."""
_RIGID = 3
"""Dimensions of a rigid motion's trajectories once their mean is taken off (Tomasi and Kanade, IJCV 1992)."""


class Whole:
    """Tracks that are seen most of the time, as a whole.

    Parameters
    ----------
    tracks : Tracks
        As they were measured: the cut bears noise better than what smoothing does to them. Their gaps are
        filled in time for it; what fits is told by what was measured alone.
    noisy : bool
        Whether they have so much noise that the cuts blur.
    """

    def __init__(self, tracks: Tracks, noisy: bool = False) -> None:
        self._tracks, self.noisy = tracks, noisy
        self._W, self._seen = trajectory_matrix(tracks, _KEY_FRAMES)
        self._interaction: ShapeInteraction | None = None
        self._cuts: dict[int, Cut] = {}

    def cut(self, motions: int) -> Cut | None:
        """All points divided into so many motions; None where that cannot be told, for one motion, in less
        than three frames, or with less than five points a motion."""
        enough = 2 * self._tracks.frames > AFFINE_RANK and self._tracks.points >= (AFFINE_RANK + 1) * motions
        if motions < 2 or not enough:
            return None
        if self._interaction is None:
            whole = without_gaps(self._tracks)
            few = Tracks.from_array(whole.xy[key_frames(whole.frames, _KEY_FRAMES)], size=whole.size)
            self._interaction = ShapeInteraction(coordinates(few))
        if motions not in self._cuts:
            self._cuts[motions] = self._interaction.cut(motions)
        return self._cuts[motions]

    def misfit(self, labels: NDArray[np.int64]) -> float:
        """Mean distance of the points from the rank-3 subspaces of their groups (P,), pixels a frame.

        Tells which of two segmentations with as many groups is better before an affine camera; with more
        groups it is always less.
        """
        distance = np.zeros(len(labels))
        for group in np.unique(labels):
            members = np.flatnonzero(labels == group)
            if len(members) > 1:
                W, seen = self._W[:, members], self._seen[:, members]
                distance[members] = Subspace.fit(W, seen, _RIGID).distance(W, seen)
        return float(distance.mean())
