"""Spectral clustering of a graph by k-means, as authors of peers used it; RSIM has a way of its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from ifsvideo.segmentation.shape_interaction import unit_rows

Floats = NDArray[np.float64]
Labels = NDArray[np.int64]

_EPS = float(np.finfo(np.float64).eps)


def leading(affinity: Floats, count: int) -> tuple[Floats, Floats]:
    """Eigenvalues (count,), greatest first, and eigenvectors (P, count) of D^-1/2 A D^-1/2.

    Parameters
    ----------
    affinity : (P, P) float64
        A, symmetric, not negative; D holds its row sums.
    count : int
        Number of eigenvectors, up to P.
    """
    P = len(affinity)
    scale = 1 / np.sqrt(affinity.sum(axis=1) + _EPS)
    values, vectors = eigh(scale[:, None] * affinity * scale, subset_by_index=(P - count, P - 1))
    return values[::-1], vectors[:, ::-1]


def cluster(affinity: Floats, groups: int, rng: np.random.Generator) -> Labels:
    """Group the points of a graph by k-means on the directions of the rows of eigenvectors.

    Parameters
    ----------
    affinity : (P, P) float64
        Symmetric, not negative.
    groups : int, up to P
    rng : numpy.random.Generator

    Returns
    -------
    (P,) int64
        0 ... groups - 1; a group may stay empty where points coincide.

    References
    ----------
    A. Ng, M. Jordan, Y. Weiss. On Spectral Clustering: Analysis and an Algorithm. NIPS 2001.
    """
    return k_means(unit_rows(leading(affinity, groups)[1]), groups, rng)


def k_means(points: Floats, groups: int, rng: np.random.Generator, restarts: int = 20) -> Labels:
    """Lloyd's k-means, started ``restarts`` times from random points; the tightest result.

    Parameters
    ----------
    points : (P, D) float64
    groups : int, up to P
    rng : numpy.random.Generator
    restarts : int
        20 as in the code of the authors of sparse subspace clustering.

    Returns
    -------
    (P,) int64
        0 ... groups - 1; a group may stay empty where points coincide.
    """
    starts = [points[rng.choice(len(points), groups, replace=False)] for _ in range(restarts)]
    return min((_lloyd(points, start) for start in starts), key=lambda found: found[0])[1]


def _lloyd(points: Floats, centres: Floats, max_rounds: int = 300) -> tuple[float, Labels]:
    """Sum of squared distances and labels, once the labels no longer change."""
    labels = np.full(len(points), -1)
    squared = np.empty(0)
    for _ in range(max_rounds):
        squared = ((points[:, None] - centres) ** 2).sum(axis=2)
        nearest = squared.argmin(axis=1)
        if (nearest == labels).all():
            break
        labels = nearest
        for group in np.unique(labels):
            centres[group] = points[labels == group].mean(axis=0)
    return float(squared.min(axis=1).sum()), labels
