"""Affine motion as a subspace: trajectories of one body before an affine camera span few dimensions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation.key_frames import key_frames
from ifsvideo.segmentation.triangles import Triangles
from ifsvideo.types import Tracks

Array = NDArray[np.float64]


def trajectory_matrix(tracks: Tracks, most_frames: int) -> tuple[Array, Array]:
    """W (2F, P) of at most so many key frames, centred, zero where a point is not seen, and its mask (2F, P)
    of ones and zeros."""
    frames = key_frames(tracks.frames, most_frames)
    xy = tracks.xy[frames] - np.nanmean(tracks.xy, axis=(0, 1))
    W = np.nan_to_num(xy.transpose(0, 2, 1).reshape(2 * len(frames), tracks.points))
    return W, np.repeat(tracks.visible[frames], 2, axis=0).astype(np.float64)


@dataclass(frozen=True)
class Subspace:
    """The affine subspace near which the trajectories of one body lie.

    Three dimensions hold any rigid body under an affine camera (Tomasi and Kanade, IJCV 1992), two a flat
    one, or one that moves by an affine map of the picture.

    Attributes
    ----------
    directions : (2F, rank) float
    mean : (2F,) float
    """

    directions: Array
    mean: Array

    @classmethod
    def fit(cls, W: Array, seen: Array, rank: int, iterations: int = 3) -> Subspace:
        """Best subspace of trajectories (2F, P): by singular values where they are complete; with gaps,
        directions and points are solved in turn by least squares over what was measured."""
        points = W.shape[1]
        rank = min(rank, points - 1, len(W))
        filled = along_mean_path(W, seen)
        mean = filled.mean(axis=1)
        found = cls(principal(filled - mean[:, None], rank) / np.sqrt(points), mean)
        if rank < 1 or seen.all():
            return found
        for _ in range(iterations):
            place = np.vstack([found._coordinates(W, seen), np.ones(points)])
            # Each row of W: its directions and mean from the points that are seen in it.
            products = (place[:, None] * place[None]).reshape(-1, points)
            left = (seen @ products.T).reshape(-1, rank + 1, rank + 1) + 1e-6 * np.eye(rank + 1)
            rows = np.linalg.solve(left, (W @ place.T)[:, :, None])[:, :, 0]
            found = cls(rows[:, :rank], rows[:, rank])
        return found

    def main(self, W: Array, seen: Array, rank: int) -> Subspace:
        """The subspace of fewer dimensions in which most of the trajectories' (2F, P) spread lies."""
        if rank >= self.rank:
            return self
        if seen.all():
            return Subspace(self.directions[:, :rank], self.mean)  # `fit` has them in this order
        inside = self._coordinates(W, seen)
        mean = inside.mean(axis=1)
        spread = self.directions @ principal(inside - mean[:, None], self.rank)
        return Subspace(principal(spread, rank) / np.sqrt(W.shape[1]), self.mean + self.directions @ mean)

    @property
    def rank(self) -> int:
        """Dimensions."""
        return int(self.directions.shape[1])

    def distance(self, W: Array, seen: Array) -> Array:
        """How far each trajectory (2F, P) is from the subspace.

        Returns
        -------
        (P,) float
            Root of the mean square distance per frame, pixels, with the degrees of freedom that the point
            itself spends taken off; 0 where it has no more measurements than those.
        """
        if seen.all():
            # What is left of trajectories is the same product of all: one system for all points.
            M, inner = self.directions, self.directions.T @ self.directions
            inner.flat[:: self.rank + 1] += 1e-6 * (np.trace(inner) + 1e-9)
            aside = np.eye(len(M)) - M @ np.linalg.solve(inner, M.T)
            error, measured = aside @ (W - self.mean[:, None]), np.float64(len(W))
        else:
            error = (W - self.mean[:, None] - self.directions @ self._coordinates(W, seen)) * seen
            measured = seen.sum(axis=0)
        free = np.maximum((measured - self.rank) / 2, 0.5)
        return np.asarray(np.sqrt(np.einsum("fp,fp->p", error, error) / free))

    def _coordinates(self, W: Array, seen: Array) -> Array:
        """Coordinates (rank, P) of the nearest points of the subspace."""
        M, rank, points = self.directions, self.rank, W.shape[1]
        products = (M[:, :, None] * M[:, None]).reshape(len(M), rank**2)
        sums = np.hstack([products, M * self.mean[:, None]]).T @ seen
        left, means = sums[: rank**2].reshape(rank, rank, points), sums[rank**2 :]
        diagonal = sums[: rank**2 : rank + 1]
        diagonal += 1e-6 * (diagonal.sum(axis=0) + 1e-9)
        return Triangles(left).solve(M.T @ W - means)


def principal(X: Array, rank: int) -> Array:
    """The first left singular vectors of X (..., R, C), times their singular values (..., R, rank).

    By way of the smaller of its two products with itself, in half the time; a direction that holds less than
    1e-8 of the spread is lost by it.
    """
    other = X.swapaxes(-1, -2)
    if X.shape[-2] > X.shape[-1]:
        return np.asarray(X @ np.linalg.eigh(other @ X)[1][..., ::-1][..., :rank])
    square, U = np.linalg.eigh(X @ other)
    return np.asarray((U * np.sqrt(np.maximum(square, 0.0))[..., None, :])[..., ::-1][..., :rank])


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
