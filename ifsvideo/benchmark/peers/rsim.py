"""Robust shape interaction matrix: the classical factorisation, normalised and sharpened."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ifsvideo.benchmark.peers import spectral
from ifsvideo.benchmark.peers.base import AFFINE_RANK, Floats, Labels, Peer, normalised
from ifsvideo.types import Tracks

_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class RobustShapeInteraction(Peer):
    """Clusters by the angles between rows of the right singular vectors, at the rank that separates best.

    Draws nothing at random: the seed makes no difference.

    References
    ----------
    P. Ji, M. Salzmann, H. Li. Shape Interaction Matrix Revisited and Robustified: Efficient Subspace
    Clustering with Corrupted and Incomplete Data. ICCV 2015. Power, ranks and the treatment of negative
    affinities follow the authors' code.

    Notes
    -----
    Hopkins-155, error % over all / two / three motions: published 1.01 / 0.78 / 1.77, here the same.
    The offset in `spectral.discretised_cut`, which the paper does not mention, is needed for that.
    """

    gamma: float = 3.5
    """Power of the affinities, so that weak ones, between motions, vanish (authors' code, which advises 3
    to 5)."""

    def divide(self, tracks: Tracks, motions: int, rng: np.random.Generator) -> Labels:
        """See `Peer.divide`."""
        W = normalised(tracks)
        # The authors keep the constant third coordinate of every frame.
        X = np.vstack([W, np.ones((tracks.frames, tracks.points))])
        V = np.linalg.svd(X, full_matrices=False)[2].T
        # From one dimension a motion to the four of an affine one (authors' code).
        ranks = range(motions, min(AFFINE_RANK * motions, V.shape[1]) + 1)
        found = [self._at_rank(V[:, :rank], motions) for rank in ranks]
        return min(found, key=lambda bound_labels: bound_labels[0])[1]

    def _at_rank(self, V: Floats, motions: int) -> tuple[float, Labels]:
        """How uncertain the cut is (least is best), and labels, from the leading right singular vectors.

        The measure is the affinity that the cut severs over the gap after the last eigenvalue that is used:
        the bound on how far noise turns the eigenvectors, from perturbation theory.
        """
        V = V / (np.linalg.norm(V, axis=1, keepdims=True) + _EPS)
        # The authors take the real part of the power: 0 where the affinity is negative, with gamma = 3.5.
        affinity = np.maximum(V @ V.T, 0.0) ** self.gamma
        labels = spectral.discretised_cut(affinity, motions)
        severed = float(affinity[labels[:, None] != labels].sum())
        values = spectral.leading(affinity, motions + 1)[0]
        return severed / max(values[-2] - values[-1], _EPS), labels
