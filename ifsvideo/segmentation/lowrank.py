"""Affine motion as a subspace: trajectories of one body before an affine camera span few dimensions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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

    Several may be stacked: each array has one axis more then, the first. What they are fitted to are sets of
    as many trajectories (..., 2F, n): smaller ones are filled up with trajectories that are nowhere seen, for
    these count for nothing (`stacks`).

    Attributes
    ----------
    directions : (..., 2F, rank) float
    mean : (..., 2F) float
    """

    directions: Array
    mean: Array

    @classmethod
    def fit(cls, W: Array, seen: Array, rank: int, iterations: int = 3) -> Subspace:
        """Best subspace of trajectories (..., 2F, n): by singular values where they are complete; with gaps,
        directions and points are solved in turn by least squares over what was measured."""
        there = _seen_anywhere(seen)
        points = np.maximum(there.sum(axis=-1), 1.0)  # (..., 1)
        rank = min(rank, int(points.min()) - 1, W.shape[-2])
        complete = bool((seen == there).all())
        filled = W if complete else along_mean_path(W, seen) * there
        mean = filled.sum(axis=-1) / points
        aside = (filled - mean[..., None]) * there
        found = cls(principal(aside, rank) / np.sqrt(points)[..., None], mean)
        if rank < 1 or complete:
            return found
        for _ in range(iterations):
            inside = found._coordinates(W, seen)
            place = np.concatenate([inside, np.ones_like(inside[..., :1, :])], axis=-2)
            # Each row of W: its directions and mean from the points that are seen in it.
            products = place[..., :, None, :] * place[..., None, :, :]
            products = products.reshape(*place.shape[:-2], -1, place.shape[-1])
            left = (products @ seen.swapaxes(-1, -2)).swapaxes(0, -2)
            left = left.reshape(rank + 1, rank + 1, *left.shape[1:])
            for axis in range(rank + 1):
                left[axis, axis] += 1e-6
            right = (place @ W.swapaxes(-1, -2)).swapaxes(0, -2)
            rows = Triangles(left).solve(right).swapaxes(0, -2)
            found = cls(rows[..., :rank, :].swapaxes(-1, -2), rows[..., rank, :])
        return found

    def main(self, W: Array, seen: Array, rank: int) -> Subspace:
        """The subspace of fewer dimensions in which most of the trajectories' (..., 2F, n) spread lies."""
        if rank >= self.rank:
            return self
        there = _seen_anywhere(seen)
        if (seen == there).all():
            return Subspace(self.directions[..., :rank], self.mean)  # `fit` has them in this order
        points = np.maximum(there.sum(axis=-1), 1.0)
        inside = self._coordinates(W, seen) * there
        mean = inside.sum(axis=-1) / points
        spread = self.directions @ principal((inside - mean[..., None]) * there, self.rank)
        return Subspace(
            principal(spread, rank) / np.sqrt(points)[..., None],
            self.mean + (self.directions @ mean[..., None])[..., 0],
        )

    @property
    def rank(self) -> int:
        """Dimensions."""
        return int(self.directions.shape[-1])

    def distance(self, W: Array, seen: Array) -> Array:
        """How far each trajectory (2F, P) is from the subspace, or from each of a stack.

        Returns
        -------
        (..., P) float
            Root of the mean square distance per frame, pixels, with the degrees of freedom that the point
            itself spends taken off; 0 where it has no more measurements than those.
        """
        M, mean = self.directions, self.mean[..., None]
        if seen.all():
            # What is left of trajectories is the same product of all: one system for all points.
            inner, axes = M.swapaxes(-1, -2) @ M, np.arange(self.rank)
            inner[..., axes, axes] += 1e-6 * (np.trace(inner, axis1=-2, axis2=-1)[..., None] + 1e-9)
            aside = np.eye(M.shape[-2]) - M @ np.linalg.solve(inner, M.swapaxes(-1, -2))
            error, measured = aside @ (W - mean), np.float64(len(W))
        else:
            error = (W - mean - M @ self._coordinates(W, seen)) * seen
            measured = seen.sum(axis=0)
        free = np.maximum((measured - self.rank) / 2, 0.5)
        return np.asarray(np.sqrt(np.einsum("...fp,...fp->...p", error, error) / free))

    def _coordinates(self, W: Array, seen: Array) -> Array:
        """Coordinates (..., rank, n) of the nearest points of the subspace."""
        M, square = self.directions, self.rank**2
        products = (M[..., :, None] * M[..., None, :]).reshape(*M.shape[:-1], square)
        factors = np.concatenate([products, M * self.mean[..., None]], axis=-1)
        sums = (factors.swapaxes(-1, -2) @ seen).swapaxes(0, -2)
        left, means = sums[:square].reshape(self.rank, self.rank, *sums.shape[1:]), sums[square:]
        diagonal = sums[: square : self.rank + 1]
        diagonal += 1e-6 * (diagonal.sum(axis=0) + 1e-9)
        right = (M.swapaxes(-1, -2) @ W).swapaxes(0, -2) - means
        return Triangles(left).solve(right).swapaxes(0, -2)


def stacks(
    W: Array, seen: Array, groups: Sequence[NDArray[np.int64]], rank: int
) -> Iterator[tuple[NDArray[np.int64], Array, Array]]:
    """Sets of trajectories that can be fitted together: as many dimensions, all complete or all with gaps.

    Parameters
    ----------
    W, seen : (2F, P) float
        Of all trajectories, as of `trajectory_matrix`.
    groups : sequence of (n,) int
        The trajectories of each set.
    rank : int
        Most dimensions of the subspaces.

    Yields
    ------
    which : (S,) int
        The groups of a stack.
    W, seen : (S, 2F, n) float
        Their trajectories, as of `Subspace`.
    """
    times = np.count_nonzero(seen, axis=0)
    kinds = [
        (min(np.count_nonzero(times[own]) - 1, rank), bool((times[own] < len(seen)).any())) for own in groups
    ]
    for kind in sorted(set(kinds)):
        which = [number for number, other in enumerate(kinds) if other == kind]
        sizes = np.array([len(groups[number]) for number in which])
        place = np.arange(sizes.max())
        there = place < sizes[:, None]
        padded = np.stack([groups[number][np.minimum(place, len(groups[number]) - 1)] for number in which])
        own, shown = (np.where(there, values[:, padded], 0.0) for values in (W, seen))
        yield np.array(which), own.swapaxes(0, 1), shown.swapaxes(0, 1)


def _seen_anywhere(seen: Array) -> Array:
    """Ones and zeros (..., 1, n): which trajectories (..., 2F, n) are seen at all."""
    return np.asarray(seen.max(axis=-2, keepdims=True, initial=0.0))


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


def along_mean_path(W: Array, seen: Array) -> Array:
    """W (..., 2F, n) with its gaps filled by each point's own offset from the mean path: where the fit
    starts, never a measurement."""
    if seen.all():
        return W
    both = seen[..., 2:, :] * seen[..., :-2, :]
    step = ((W[..., 2:, :] - W[..., :-2, :]) * both).sum(axis=-1) / np.maximum(both.sum(axis=-1), 1)
    frames = np.cumsum(step.reshape(*step.shape[:-1], -1, 2), axis=-2).reshape(step.shape)
    path = np.concatenate([np.zeros((*step.shape[:-1], 2)), frames], axis=-1)[..., None]
    beside = (W - path) * seen
    offset = np.stack([beside[..., axis::2, :].sum(axis=-2) for axis in (0, 1)], axis=-2)
    offset /= np.maximum(seen[..., None, ::2, :].sum(axis=-2), 1)
    return np.where(seen > 0, W, path + np.tile(offset, (W.shape[-2] // 2, 1)))
