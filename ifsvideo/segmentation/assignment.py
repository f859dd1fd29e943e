"""Stage 3: residuals of every point to every model, and the points that no model holds (thesis 3.0.3, eq.
3.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation.lowrank import along_mean_path, principal
from ifsvideo.segmentation.sampling import AffineModels
from ifsvideo.types import Bools, Tracks

_SIZES = 4
"""Models whose numbers of inliers are alike are taken together, as if these were multiples of so many."""


def residuals(tracks: Tracks, models: AffineModels, centred: bool) -> NDArray[np.float64]:
    """Distance of each trajectory to each model's subspace, ``r = |U U^T w - w|`` (thesis eq. 3.3).

    U holds the first two left singular vectors of the model's inlier trajectories. Where a point is not seen
    in every frame, the projection is the least-squares one on the frames in which it is seen; for complete
    tracks that is the equation to the letter.

    Parameters
    ----------
    centred : bool
        Take the inliers' mean trajectory off first; two vectors are then exactly a 2-D affine motion.

    Returns
    -------
    (M, P) float
        Root of the mean square distance per frame, pixels; infinite for a point seen in fewer than 2 frames,
        which any model of rank 2 explains.
    """
    seen = np.repeat(tracks.visible, 2, axis=0).astype(np.float64)  # (2F, P)
    # Offset by the mean of all keeps squares small, so that their differences stay exact.
    offset = np.nanmean(tracks.xy, axis=(0, 1)) if centred else np.zeros(2)
    W = np.nan_to_num((tracks.xy - offset).transpose(0, 2, 1).reshape(2 * tracks.frames, tracks.points))
    frames = tracks.visible.sum(axis=0)
    if not len(models):
        return np.empty((0, tracks.points))
    complete = bool(seen.all())
    mean, main = np.zeros((len(models), len(W))), np.zeros((2, len(models), len(W)))
    sizes = models.inliers.sum(axis=1)
    few = -(-sizes // _SIZES) * _SIZES
    for size in set(few.tolist()):  # what has nearly one shape is one stack
        same = np.flatnonzero(few == size)
        own = np.argsort(~models.inliers[same], axis=1, kind="stable")[:, :size]
        there = (np.arange(own.shape[1]) < sizes[same, None])[:, None].astype(np.float64)
        paths = W[:, own].transpose(1, 0, 2) * there
        if not complete:
            paths = along_mean_path(paths, seen[:, own].transpose(1, 0, 2) * there) * there
        if centred:
            mean[same] = paths.sum(axis=2) / sizes[same, None]
            paths = (paths - mean[same, :, None]) * there
        axes = principal(paths, 2)
        main[: axes.shape[2], same] = np.moveaxis(axes, 2, 0)
    u, v = main / np.maximum(np.sqrt((main * main).sum(axis=2, keepdims=True)), 1e-12)
    # With D = (W - mean) where seen, all sums over frames are products of matrices (M, 2F) (2F, P).
    if complete:
        seen = seen[:, :1]  # one point stands for all
    square = (W**2).sum(axis=0) - 2 * mean @ W + mean**2 @ seen
    du, dv = (axis @ W - (axis * mean) @ seen for axis in (u, v))
    uu, uv, vv = ((one * other) @ seen for one, other in ((u, u), (u, v), (v, v)))
    # The projection's coordinates, from the normal equations on the visible rows.
    determinant = np.maximum(uu * vv - uv**2, 1e-9)
    a, b = (vv * du - uv * dv) / determinant, (uu * dv - uv * du) / determinant
    # Exact to the second order in the error of a and b, where |D|^2 - a U^T D is to the first.
    square += a * (a * uu + 2 * b * uv - 2 * du) + b * (b * vv - 2 * dv)
    result = np.sqrt(np.maximum(square, 0.0) / np.maximum(frames, 1))
    result[:, frames < 2] = np.inf
    return np.asarray(result)


def assign(
    tracks: Tracks, models: AffineModels, residual: NDArray[np.float64], base: int, nearest: int
) -> NDArray[np.int64]:
    """First label of every point: of the ``nearest`` models of least residual, the one whose controls are
    nearest.

    A point that models hold already chooses among these alone.

    Returns
    -------
    (P,) int
        Index of the model.
    """
    anchor = np.where(tracks.visible[base, :, None], tracks.xy[base], np.nanmean(tracks.xy, axis=0))
    distance = np.linalg.norm(anchor[None, :, None] - models.controls[:, None], axis=3).min(axis=2)  # (M, P)
    cost = np.where(models.inliers | ~models.inliers.any(axis=0), residual, np.inf)
    rank = np.argsort(np.argsort(cost, axis=0, kind="stable"), axis=0)
    fits = np.isfinite(cost)
    allowed: Bools = (fits & (rank < nearest)) | ~fits.any(axis=0)
    return np.asarray(np.argmin(np.where(allowed, distance, np.inf), axis=0), dtype=np.int64)
