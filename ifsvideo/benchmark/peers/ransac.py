"""RANSAC on motion subspaces, the simplest method of the Hopkins-155 benchmark."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.benchmark.peers.base import Floats, Labels, Peer
from ifsvideo.segmentation.shape_interaction import AFFINE_RANK
from ifsvideo.types import Tracks

Subspace = NDArray[np.float64]
"""Orthonormal basis (D, 4)."""


@dataclass(frozen=True)
class RansacSubspaces(Peer):
    """Takes one subspace of four dimensions after the other out of the projected trajectories.

    References
    ----------
    R. Tron, R. Vidal. A Benchmark for the Comparison of 3-D Motion Segmentation Algorithms. CVPR 2007.
    Dimension, threshold, stopping rule and the final assignment follow the authors' published code.

    Notes
    -----
    Hopkins-155, error % over all / two / three motions: published 9.48 / 5.56 / 22.94,
    here 9.46 / 5.60 / 22.67 (mean of 10 runs, whose figures over all have a standard deviation of 0.35).
    """

    dimension: int = 5
    """Trajectories are projected to so many dimensions; subspaces of four are still distinct in five
    (authors' code)."""

    threshold: float = 2e-5
    """Squared distance to a subspace up to which a point belongs to it, in the space of the right
    singular vectors, which have unit length (authors' code)."""

    certainty: float = 0.99
    """Trials go on until a sample without a foreign point was drawn with this probability."""

    max_trials: int = 3000
    """Ends the trials where a subspace has few points (authors' code)."""

    def divide(self, tracks: Tracks, motions: int, rng: np.random.Generator) -> Labels:
        """See `Peer.divide`."""
        # Pixels, and vectors not scaled by the singular values, as the authors do it; with coordinates in
        # [-1, 1] the threshold would mean something else.
        X = np.linalg.svd(tracks.W, full_matrices=False)[2][: self.dimension]
        left = np.ones(X.shape[1], dtype=bool)
        subspaces: list[Subspace] = []
        for _ in range(motions):
            if left.sum() < AFFINE_RANK:
                left = _farthest(X, subspaces)
            inliers = self._best_inliers(X[:, left], rng)
            chosen = np.flatnonzero(left)[inliers]
            subspaces.append(_fit(X[:, chosen]))
            left[chosen] = False
        return np.asarray(_squared_distances(X, subspaces).argmin(axis=0))

    def _best_inliers(self, X: Floats, rng: np.random.Generator) -> NDArray[np.int64]:
        """Points of the subspace through four of the points (D, P) that has the most points."""
        best = np.empty(0, dtype=np.int64)
        trial, needed = 0, 1.0
        while trial < min(needed, self.max_trials):
            trial += 1
            sample = rng.choice(X.shape[1], AFFINE_RANK, replace=False)
            basis = np.linalg.qr(X[:, sample])[0]
            inliers = np.flatnonzero(_squared_distances(X, [basis])[0] < self.threshold)
            if len(inliers) > len(best):
                best = inliers
                needed = self._trials(len(best) / X.shape[1])
        return best

    def _trials(self, share: float) -> float:
        """Trials needed where this share of the points lies in the subspace."""
        pure = share**AFFINE_RANK
        return math.log1p(-self.certainty) / math.log1p(-pure) if pure < 1 else 0.0


def _fit(X: Floats) -> Subspace:
    """The subspace nearest to points (D, P)."""
    return np.linalg.svd(X, full_matrices=False)[0][:, :AFFINE_RANK]


def _squared_distances(X: Floats, subspaces: list[Subspace]) -> Floats:
    """Squared distance of each point (D, P) to each subspace, (S, P)."""
    return np.stack([((X - basis @ (basis.T @ X)) ** 2).sum(axis=0) for basis in subspaces])


def _farthest(X: Floats, subspaces: list[Subspace]) -> NDArray[np.bool_]:
    """The four points that the subspaces found so far explain worst: where too few are left for another."""
    nearest = _squared_distances(X, subspaces).min(axis=0)
    chosen = np.zeros(X.shape[1], dtype=bool)
    chosen[np.argsort(nearest)[-AFFINE_RANK:]] = True
    return chosen
