"""Stage 2: a pool of affine motion models, sampled in small disks (thesis 3.0.2, Algorithm 1, eq. 3.1,
3.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.types import Bools, Tracks

# Triples whose triangle is smaller than this share of a disk's area are taken for collinear: eq. 3.2 inverts
# them.
_SMALLEST_TRIANGLE = 0.01


@dataclass(frozen=True)
class AffineModels:
    """The tuples (I_in, C_pts, S) of thesis Algorithm 1 for M models.

    Attributes
    ----------
    inliers : (M, P) bool
    controls : (M, 3, 2) float
        The three control points in the base frame, pixels.
    foreground : (M,) bool
        Attribute S: whether the disk was centred on a foreground point.
    """

    inliers: Bools
    controls: NDArray[np.float64]
    foreground: Bools

    def __len__(self) -> int:
        return len(self.foreground)

    def select(self, models: NDArray[np.int64]) -> AffineModels:
        """Some of the models."""
        return AffineModels(self.inliers[models], self.controls[models], self.foreground[models])


def sample_models(
    tracks: Tracks,
    background: Bools,
    base: int,
    unit: float,
    config: SegmenterConfig,
    rng: np.random.Generator,
) -> AffineModels:
    """Sample ``config.models`` affine motion models.

    Parameters
    ----------
    tracks : Tracks
        Points not seen in the base frame take no part.
    background : (P,) bool
        Result of stage 1.
    base : int
        The frame in which disks lie and from which motion is counted.
    unit : float
        Pixels per configured pixel (the configuration speaks of a 640x480 picture).

    Returns
    -------
    AffineModels
        At most ``config.models``; fewer where no disk holds three points.
    """
    window = _Window.of(tracks, base)
    usable, (x, y) = window.usable, window.place
    radius = config.disk_radius * unit
    pools = [np.flatnonzero(usable & ~background), np.flatnonzero(usable & background)]
    inliers: list[Bools] = []
    controls: list[NDArray[np.float64]] = []
    foreground: list[bool] = []
    # A disk may hold fewer than three points or only collinear ones; give up after as many failures as
    # models.
    for _ in range(2 * config.models):
        if len(inliers) == config.models or not len(pools[0]) + len(pools[1]):
            break
        fg = bool(rng.random() < config.foreground_share)
        pool = pools[0] if (fg and len(pools[0])) or not len(pools[1]) else pools[1]
        fg = pool is pools[0]
        centre = int(pool[rng.integers(len(pool))])
        support = np.flatnonzero(
            usable & ((x - x[centre]) ** 2 + (y - y[centre]) ** 2 < radius**2)
        )  # eq. 3.1
        through = centre if config.through_centre else None
        best = _best_triple(window, support, through, unit, config, rng)
        if best is not None:
            mask = np.zeros(tracks.points, dtype=bool)
            mask[best[0]] = True
            inliers.append(mask)
            controls.append(window.place[:, best[1]].T)
            foreground.append(fg)
    return AffineModels(
        np.array(inliers, dtype=bool).reshape(len(inliers), tracks.points),
        np.array(controls, dtype=np.float64).reshape(-1, 3, 2),
        np.array(foreground, dtype=bool),
    )


@dataclass(frozen=True)
class _Window:
    """The tracks with the points last.

    Attributes
    ----------
    place : (2, P) float
        In the base frame.
    usable : (P,) bool
        Whether they are seen there.
    path : (2 (F - 1), P) float
        In the other frames, all x first.
    seen : (F - 1, P) float
        One where they are seen there, else zero.
    """

    place: NDArray[np.float64]
    usable: Bools
    path: NDArray[np.float64]
    seen: NDArray[np.float64]

    @classmethod
    def of(cls, tracks: Tracks, base: int) -> _Window:
        other = np.arange(tracks.frames) != base  # the base frame maps to itself
        path = tracks.xy[other].transpose(2, 0, 1).reshape(2 * other.sum(), tracks.points)
        seen = tracks.visible[other].astype(np.float64)
        return cls(tracks.xy[base].T.copy(), tracks.visible[base], path, seen)


def _best_triple(
    window: _Window,
    support: NDArray[np.int64],
    through: int | None,
    unit: float,
    config: SegmenterConfig,
    rng: np.random.Generator,
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Inliers and control points of the triple that explains most of the support, None where none serves.

    ``through`` names a point that must be one of the three."""
    if len(support) < 3:
        return None
    triples = _triples(len(support), config.ransac_iterations, rng)
    if through is not None:
        own = int(np.searchsorted(support, through))
        triples[~(triples == own).any(axis=1), 0] = own
    place = window.place[:, support]
    corners = place[:, triples]  # (2, T, 3)
    first = corners[..., 0]
    (x1, x2), (y1, y2) = (corners[..., 1:] - first[..., None]).transpose(0, 2, 1)
    twice_area = x1 * y2 - y1 * x2
    wide = np.abs(twice_area) / 2 > _SMALLEST_TRIANGLE * (config.disk_radius * unit) ** 2
    if not wide.all():
        if not wide.any():
            return None
        triples, first, twice_area = triples[wide], first[:, wide], twice_area[wide]
        x1, x2, y1, y2 = x1[wide], x2[wide], y1[wide], y2[wide]
    # eq. 3.2: A_{1->f} = [c_f; 1] [c_1; 1]^-1, so a point is transferred by its barycentric coordinates in
    # c_1.
    x, y = place[:, None] - first[..., None]
    barycentric = np.empty((len(triples), 3, len(support)))
    area = twice_area[:, None]
    barycentric[:, 1] = (x * y2[:, None] - y * x2[:, None]) / area
    barycentric[:, 2] = (x1[:, None] * y - y1[:, None] * x) / area
    barycentric[:, 0] = 1 - barycentric[:, 1] - barycentric[:, 2]
    path, seen = window.path[:, support], window.seen[:, support]
    # (T, 2 (F - 1), P), NaN where a corner is unseen
    error = path[:, triples].transpose(1, 0, 2) @ barycentric
    error -= path
    np.multiply(error, error, out=error)
    frames = len(seen)
    error[:, :frames] += error[:, frames:]
    fits = error[:, :frames] < (config.inlier_error * unit) ** 2
    counted = seen[:, triples].prod(axis=2).T @ seen
    inlier = (fits.sum(axis=1) >= 0.5 * counted) & (counted > 0)
    winner = int(np.argmax(inlier.sum(axis=1)))
    chosen = np.array(inlier[winner])
    chosen[triples[winner]] = True
    return support[chosen], support[triples[winner]]


_ORDERS = np.array([[[1, 2, 0], [2, 1, 0]], [[2, 0, 1], [0, 2, 1]], [[1, 0, 2], [0, 1, 2]]])
"""What becomes of three things when the last and then the middle one change places with one up to it."""


def _triples(points: int, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Three different ones of so many points, in any order, so many times (T, 3).

    By Floyd's algorithm, as numpy's `Generator.choice` has it for one triple: of numbers that are drawn from
    ever more, one that was drawn before stands for the last of them.
    """
    most = np.array([points - 3, points - 2, points - 1, 2, 1])
    drawn = rng.integers(0, np.broadcast_to(most, (count, 5)), endpoint=True)
    first, second, third = drawn[:, :3].T
    second[second == first] = points - 2
    third[(third == first) | (third == second)] = points - 1
    order: NDArray[np.int64] = _ORDERS[drawn[:, 3], drawn[:, 4]]
    return np.asarray(drawn[np.arange(count)[:, None], order])
