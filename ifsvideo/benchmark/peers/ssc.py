"""Sparse subspace clustering: every trajectory as a combination of few others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ifsvideo.benchmark.peers import spectral
from ifsvideo.benchmark.peers.base import Floats, Labels, Peer
from ifsvideo.segmentation.shape_interaction import normalised
from ifsvideo.types import Tracks

_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class SparseSubspaceClustering(Peer):
    """Writes each trajectory as an affine combination of few others, which are mostly of its own motion.

    References
    ----------
    E. Elhamifar, R. Vidal. Sparse Subspace Clustering. CVPR 2009; Sparse Subspace Clustering: Algorithm,
    Theory, and Applications. PAMI 2013. Equations are those of PAMI 2013, values those that the authors'
    code uses for motion segmentation: full trajectories, affine constraint, noise but no outliers.

    Notes
    -----
    Hopkins-155, error % over all / two / three motions: published 2.18 / 1.52 / 4.40 (PAMI 2013; 2.70
    over all in some later tables), here 2.18 / 1.53 / 4.41. Needs a few matrices of P x P numbers, and
    time that grows with the cube of P.
    """

    alpha: float = 800.0
    """Weight of the noise term over the least one that keeps the coefficients from vanishing, and step
    of the alternating directions (authors' code)."""

    rho: float = 0.7
    """Share of a column's absolute sum that its strongest coefficients keep (authors' code)."""

    tolerance: float = 2e-4
    """Greatest violation of a constraint at which the iterations end (authors' code)."""

    max_iterations: int = 200
    """Ends the iterations where the tolerance is not reached (authors' code)."""

    def divide(self, tracks: Tracks, motions: int, rng: np.random.Generator) -> Labels:
        """See `Peer.divide`."""
        C = np.abs(strongest(self.coefficients(normalised(tracks)), self.rho))
        C /= C.max(axis=0) + _EPS
        return spectral.cluster(C + C.T, motions, rng)

    def coefficients(self, Y: Floats) -> Floats:
        """Sparse C that minimises ``|C|_1 + lambda/2 |Y - Y C|_F^2``, diag C = 0, columns adding up to 1.

        Solved by alternating directions (PAMI 2013, appendix).

        Parameters
        ----------
        Y : (D, P) float64

        Returns
        -------
        (P, P) float64
        """
        P = Y.shape[1]
        gram = Y.T @ Y
        lam = self.alpha / (_least_peak(gram) + _EPS)
        mu = self.alpha
        inverse = np.linalg.inv(lam * gram + mu * (np.eye(P) + 1))
        C = np.zeros((P, P))
        dual, dual_sum = np.zeros((P, P)), np.zeros(P)
        for _ in range(self.max_iterations - 1):
            Z = inverse @ (lam * gram + mu * C - dual + (mu - dual_sum))
            np.fill_diagonal(Z, 0.0)
            shifted = Z + dual / mu
            C = np.sign(shifted) * np.maximum(np.abs(shifted) - 1 / mu, 0.0)
            excess = Z.sum(axis=0) - 1
            dual += mu * (Z - C)
            dual_sum += mu * excess
            if max(np.abs(Z - C).max(), np.abs(excess).max()) <= self.tolerance:
                break
        return C


def strongest(C: Floats, rho: float) -> Floats:
    """Keep each column's strongest coefficients, as many as hold the share ``rho`` of its absolute sum."""
    order = np.argsort(-np.abs(C), axis=0)
    ranked = np.take_along_axis(np.abs(C), order, axis=0)
    # Kept while the coefficients before it do not yet hold the share.
    before = np.cumsum(ranked, axis=0) - ranked
    keep = np.empty(C.shape, dtype=bool)
    np.put_along_axis(keep, order, before < rho * ranked.sum(axis=0), axis=0)
    return np.where(keep, C, 0.0)


def _least_peak(gram: Floats) -> float:
    """Least, over the columns, of the greatest product with another column (PAMI 2013)."""
    return float(np.abs(gram - np.diag(np.diag(gram))).max(axis=0).min())
