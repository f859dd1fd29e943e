"""What the peers share: they are told the number of motions, and need tracks without a gap."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.errors import UsageError
from ifsvideo.segmentation.shape_interaction import AFFINE_RANK
from ifsvideo.types import BACKGROUND, UNDECIDED, Segmentation, Tracks

Floats = NDArray[np.float64]
Labels = NDArray[np.int64]


@dataclass(frozen=True)
class Peer(ABC):
    """A published segmenter that is given the number of motions; a `ifsvideo.types.Segmenter`.

    Parameters
    ----------
    seed : int
        Same tracks and seed: same labels.
    """

    seed: int = 0

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        """Label every track that is seen in every frame; the others stay undecided (-1).

        The methods do not know which motion is the static world's: labels are by size, the largest group
        is 0. With less than three frames, or less than five complete tracks a motion, subspaces of four
        dimensions cannot be told apart, and nothing is decided.

        Parameters
        ----------
        tracks : Tracks
        motions : int
            Number of motions, background included.

        Raises
        ------
        UsageError
            If the number of motions is not given.
        ValueError
            If it is less than 1.
        """
        if motions is None:
            raise UsageError(
                f"{type(self).__name__} cannot find the number of motions; give it (--motions-known)"
            )
        if motions < 1:
            raise ValueError(f"the number of motions is at least 1, got {motions}")
        labels = np.full(tracks.points, UNDECIDED, dtype=np.int64)
        complete = np.flatnonzero(tracks.visible.all(axis=0))
        if 2 * tracks.frames > AFFINE_RANK and len(complete) >= (AFFINE_RANK + 1) * motions:
            groups = self.divide(tracks.select(complete), motions, np.random.default_rng(self.seed))
            labels[complete] = by_size(groups)
        decided = (labels != UNDECIDED).astype(np.float64)
        return Segmentation(labels, labels == BACKGROUND, labels.copy(), decided)

    @abstractmethod
    def divide(self, tracks: Tracks, motions: int, rng: np.random.Generator) -> Labels:
        """Divide trajectories into motions.

        Parameters
        ----------
        tracks : Tracks
            Every point seen in every frame.
        motions : int, from 1
        rng : numpy.random.Generator

        Returns
        -------
        (P,) int64
            Group of each trajectory, 0 ... motions - 1 in any order; a group may be empty.
        """


def by_size(labels: Labels) -> Labels:
    """Number the groups 0, 1, ... by size, largest first; of two of a size, the lower number stays first."""
    _, group, counts = np.unique(labels, return_inverse=True, return_counts=True)
    rank = np.empty(len(counts), dtype=np.int64)
    rank[np.argsort(-counts, kind="stable")] = np.arange(len(counts))
    return rank[group]
