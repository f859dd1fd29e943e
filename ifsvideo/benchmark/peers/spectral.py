"""Spectral clustering of a graph, in the two ways that the peers' authors used."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

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
    return k_means(_unit_rows(leading(affinity, groups)[1]), groups, rng)


def discretised_cut(affinity: Floats, groups: int, offset: float = 0.5) -> Labels:
    """Group the points of a graph by turning the eigenvectors until their rows are nearest to the axes.

    Parameters
    ----------
    affinity : (P, P) float64
        Symmetric, not negative.
    groups : int, up to P
    offset : float
        Added to each point's affinity to itself, twice it to its degree, as in the authors' code: a few
        points that hardly touch the rest are then not worth a group.

    Returns
    -------
    (P,) int64
        0 ... groups - 1; a group may stay empty.

    References
    ----------
    S. Yu, J. Shi. Multiclass Spectral Clustering. ICCV 2003.
    """
    scale = 1 / np.sqrt(affinity.sum(axis=1) + 2 * offset + _EPS)
    P = len(affinity)
    regular = scale[:, None] * (affinity + offset * np.eye(P)) * scale
    vectors = scale[:, None] * eigh(regular, subset_by_index=(P - groups, P - 1))[1][:, ::-1]
    X = _unit_rows(vectors / np.linalg.norm(vectors, axis=0))
    return _turned(X, _far_apart(X))


def _far_apart(X: Floats) -> Floats:
    """Rows of X (P, K) as columns (K, K): the middle row, then the one most orthogonal to those before."""
    chosen = [X[len(X) // 2]]
    likeness = np.zeros(len(X))
    while len(chosen) < X.shape[1]:
        likeness += np.abs(X @ chosen[-1])
        chosen.append(X[likeness.argmin()])
    return np.stack(chosen, axis=1)


def _turned(X: Floats, R: Floats, max_rounds: int = 20) -> Labels:
    """Nearest axis of each row of X R, with the rotation R fitted to these axes in turn."""
    labels = np.full(len(X), -1)
    for _ in range(max_rounds):
        nearest = (X @ R).argmax(axis=1)
        if (nearest == labels).all():
            break
        labels = nearest
        U, _, Vt = np.linalg.svd(X.T @ np.eye(len(R))[labels])
        R = U @ Vt
    return labels


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


def _unit_rows(X: Floats) -> Floats:
    return np.asarray(X / (np.linalg.norm(X, axis=1, keepdims=True) + _EPS))
