"""Affine rigid motion as a subspace: trajectories of one rigid body span three dimensions round their
mean."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import Tracks


def rigid_residual(tracks: Tracks, rank: int = 3, iterations: int = 8) -> NDArray[np.float64]:
    """How far each trajectory is from the best common subspace of all given ones.

    Under an affine camera the trajectories of one rigid body lie in a 3-dimensional affine subspace (Tomasi
    and Kanade, IJCV 1992). Complete tracks are fitted by singular values; with gaps, frames and points are
    solved in turn by least squares over what was measured.

    Returns
    -------
    (P,) float
        Root of the mean square distance per frame, pixels, with the degrees of freedom that the point itself
        spends taken off; 0 where it has no more measurements than those.
    """
    frames, points = tracks.frames, tracks.points
    seen = np.repeat(tracks.visible, 2, axis=0).astype(np.float64)
    centre = np.nanmean(tracks.xy, axis=(0, 1))
    W = np.nan_to_num((tracks.xy - centre).transpose(0, 2, 1).reshape(2 * frames, points))
    free = np.maximum(tracks.visible.sum(axis=0) - rank / 2, 0.5)
    rank = min(rank, points - 1, 2 * frames)
    if rank < 1:
        return np.zeros(points)
    filled = along_mean_path(W, seen)
    mean = filled.mean(axis=1)
    U, S, V = np.linalg.svd(filled - mean[:, None], full_matrices=False)
    basis = np.column_stack([U[:, :rank] * S[:rank], mean])  # the mean is one more column, its coefficient 1
    if seen.all():
        error = W - basis @ np.vstack([V[:rank], np.ones(points)])
        return np.asarray(np.sqrt((error**2).sum(axis=0) / free))
    tiny = 1e-6 * np.eye(rank)
    for _ in range(iterations):
        M, mu = basis[:, :rank], basis[:, rank]
        scale = max(float(np.einsum("ij,ij->", M, M)) / rank, 1e-9)
        left = np.einsum("ra,rb,rp->pab", M, M, seen) + scale * tiny
        right = np.einsum("ra,rp->pa", M, (W - mu[:, None]) * seen)
        shape = np.linalg.solve(left, right[:, :, None])[:, :, 0]
        extended = np.column_stack([shape, np.ones(points)])
        left = np.einsum("pa,pb,rp->rab", extended, extended, seen) + 1e-6 * np.eye(rank + 1)
        right = np.einsum("pa,rp->ra", extended, W * seen)
        basis = np.linalg.solve(left, right[:, :, None])[:, :, 0]
    error = (W - basis @ extended.T) * seen
    return np.asarray(np.sqrt((error**2).sum(axis=0) / free))


def along_mean_path(W: NDArray[np.float64], seen: NDArray[np.float64]) -> NDArray[np.float64]:
    """W with its gaps filled by each point's own offset from the mean path: where the fit starts, never a
    measurement."""
    if seen.all():
        return W
    both = seen[2:] * seen[:-2]
    step = ((W[2:] - W[:-2]) * both).sum(axis=1) / np.maximum(both.sum(axis=1), 1)
    path = np.concatenate([np.zeros(2), np.cumsum(step.reshape(-1, 2), axis=0).ravel()])
    offset = np.stack([((W - path[:, None]) * seen)[axis::2].sum(axis=0) for axis in (0, 1)])
    offset /= np.maximum(seen[::2].sum(axis=0), 1)
    return np.where(seen > 0, W, path[:, None] + np.tile(offset, (len(W) // 2, 1)))
