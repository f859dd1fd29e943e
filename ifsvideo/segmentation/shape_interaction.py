"""All trajectories cut at once into a given number of motions, by their shape interaction matrix.

Trajectories of one rigid motion before an affine camera span few dimensions, and those of independent motions
span different ones: in the space that all span, rows of the right singular vectors are orthogonal where two
points move apart (Costeira and Kanade, IJCV 1998). Noise and motions that share dimensions blur this; the
robust form takes directions of the rows alone, sharpens their products, and tries several ranks.

References
----------
P. Ji, M. Salzmann, H. Li. Shape Interaction Matrix Revisited and Robustified: Efficient Subspace Clustering
with Corrupted and Incomplete Data. ICCV 2015 (RSIM). Power, ranks and the treatment of negative affinities
follow the authors' code.
S. Yu, J. Shi. Multiclass Spectral Clustering. ICCV 2003.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import eigsh

from ifsvideo.types import Tracks

Array = NDArray[np.float64]
Labels = NDArray[np.int64]

AFFINE_RANK = 4
"""Trajectories of one rigid motion seen by an affine camera span a subspace of so many dimensions."""

_EPS = float(np.finfo(np.float64).eps)
_MOST = 1000
"""Points that are cut at once, for the matrix has the square of their number; the others join these."""
_SPREAD = 1e-12
"""Share of the greatest squared singular value below which there is no direction, only rounding."""
_EXACT = 1e-4
"""Relative error of the eigenvalues: the cut asks where eigenvectors point, not for their digits."""


@dataclass(frozen=True)
class Cut:
    """Trajectories divided into a number of motions.

    Attributes
    ----------
    labels : (P,) int64
        Group of each trajectory, from 0, in any order; a group may be empty.
    uncertainty : float
        The affinity that the cut severs over the gap after the last eigenvalue that is used: a bound on how
        far noise turns the eigenvectors (perturbation theory). Above 0.
    """

    labels: Labels
    uncertainty: float


class ShapeInteraction:
    """The shape interaction matrix of some trajectories.

    Parameters
    ----------
    X : (R, P) float64
        Trajectories without gaps as columns, of points that are all finite; of any scale, but the authors'
        with a constant coordinate beside x and y of every frame (`coordinates`).
    """

    def __init__(self, X: Array) -> None:
        self._rows = _row_space(X)
        self._few = np.arange(X.shape[1])[:: 1 + (X.shape[1] - 1) // _MOST]

    def cut(self, motions: int) -> Cut:
        """Divide the trajectories into so many motions, at the rank at which that is least uncertain; nothing
        is drawn at random. Needs five trajectories a motion."""
        dimensions = self._rows.shape[1]
        # From one dimension a motion to the four of an affine one (authors' code).
        ranks = range(min(motions, dimensions), min(AFFINE_RANK * motions, dimensions) + 1)
        found = [(self._at_rank(rank, motions), rank) for rank in ranks]
        best, rank = min(found, key=lambda item: item[0].uncertainty)
        if len(self._few) == len(self._rows):
            return best
        # The others go where they are most alike in the mean.
        V = unit_rows(self._rows[:, :rank])
        groups = np.eye(motions)[best.labels]
        alike = _sharpened(V @ V[self._few].T) @ groups / np.maximum(groups.sum(axis=0), 1)
        return Cut(alike.argmax(axis=1), best.uncertainty)

    def _at_rank(self, rank: int, motions: int) -> Cut:
        V = unit_rows(self._rows[self._few, :rank])
        affinity = _sharpened(V @ V.T)
        labels, gap = discretised_cut(affinity, motions)
        groups = np.eye(motions)[labels]
        severed = affinity.sum() - np.einsum("pk,pk->", groups, affinity @ groups)
        return Cut(labels, max(float(severed), _EPS) / max(gap, _EPS))


def _sharpened(products: Array) -> Array:
    """Products of directions to the power 3.5, so that weak ones, between motions, vanish (authors' code,
    which advises 3 to 5; it takes the real part, which is 0 where a product is negative)."""
    positive = np.maximum(products, 0.0)
    return np.asarray(positive * positive * positive * np.sqrt(positive))


def coordinates(tracks: Tracks) -> Array:
    """Trajectories (3F, P) of complete tracks: `normalised`, and a constant coordinate for every frame, which
    the authors of RSIM keep."""
    return np.vstack([normalised(tracks), np.ones((tracks.frames, tracks.points))])


def normalised(tracks: Tracks) -> Array:
    """Trajectory matrix (2F, P) of complete tracks with the picture's sides at -1 and 1.

    These are the coordinates x of Hopkins-155. Where the size of the picture is not known, the extent of
    the points stands in.
    """
    if tracks.size is None:
        low, high = tracks.xy.min(axis=(0, 1)), tracks.xy.max(axis=(0, 1))
    else:
        low, high = np.zeros(2), np.array(tracks.size, dtype=np.float64)
    centre, half = (low + high) / 2, np.maximum((high - low) / 2, 1e-9)
    scaled = Tracks.from_array((tracks.xy - centre) / half)
    return scaled.W


def discretised_cut(affinity: Array, groups: int, offset: float = 0.5) -> tuple[Labels, float]:
    """Group the points of a graph by turning the eigenvectors until their rows are nearest to the axes.

    Parameters
    ----------
    affinity : (P, P) float64
        Symmetric, not negative.
    groups : int
        Up to P - 2.
    offset : float
        Added to each point's affinity to itself, twice it to its degree, as in the authors' code, though
        their papers do not mention it: a few points that hardly touch the rest are then not worth a group.

    Returns
    -------
    labels : (P,) int64
        0 ... groups - 1; a group may stay empty.
    gap : float
        Between the last eigenvalue that is used and the next.
    """
    P = len(affinity)
    scale = 1 / np.sqrt(affinity.sum(axis=1) + 2 * offset + _EPS)
    regular = scale[:, None] * affinity * scale
    regular.flat[:: P + 1] += offset * scale**2
    # A few of many: Lanczos's method takes a tenth of a full decomposition's time. Always the same start.
    start = np.random.default_rng(0).random(P)
    values, vectors = eigsh(regular, groups + 1, which="LA", v0=start, tol=_EXACT)
    order = np.argsort(-values, kind="stable")
    vectors = scale[:, None] * vectors[:, order[:groups]]
    X = unit_rows(vectors / np.linalg.norm(vectors, axis=0))
    return _turned(X, _far_apart(X)), float(values[order[-2]] - values[order[-1]])


def _far_apart(X: Array) -> Array:
    """Rows of X (P, K) as columns (K, K): the middle row, then the one most orthogonal to those before."""
    chosen = [X[len(X) // 2]]
    likeness = np.zeros(len(X))
    while len(chosen) < X.shape[1]:
        likeness += np.abs(X @ chosen[-1])
        chosen.append(X[likeness.argmin()])
    return np.stack(chosen, axis=1)


def _turned(X: Array, R: Array, max_rounds: int = 20) -> Labels:
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


def unit_rows(X: Array) -> Array:
    """X with rows of length 1."""
    return np.asarray(X / (np.linalg.norm(X, axis=1, keepdims=True) + _EPS))


def _row_space(X: Array) -> Array:
    """Right singular vectors (P, D) of X, by way of the smaller of its two products with itself."""
    if len(X) <= X.shape[1]:
        square, U = np.linalg.eigh(X @ X.T)
        kept = square > _SPREAD * square[-1]
        return np.asarray((X.T @ U[:, kept] / np.sqrt(square[kept]))[:, ::-1])
    square, V = np.linalg.eigh(X.T @ X)
    return np.asarray(V[:, square > _SPREAD * square[-1]][:, ::-1])
