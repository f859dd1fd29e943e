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
    usable, place = window.usable, window.place.T
    pools = [np.flatnonzero(usable & ~background), np.flatnonzero(usable & background)]
    inliers: list[Bools] = []
    controls: list[NDArray[np.float64]] = []
    foreground: list[bool] = []
    # A disk may hold fewer than three points or only collinear ones; give up after as many failures as
    # models.
    for _ in range(2 * config.models):
        if len(inliers) == config.models or not usable.any():
            break
        fg = bool(rng.random() < config.foreground_share)
        pool = pools[0] if (fg and len(pools[0])) or not len(pools[1]) else pools[1]
        fg = pool is pools[0]
        centre = int(rng.choice(pool))
        distance = np.linalg.norm(place - place[centre], axis=1)
        support = np.flatnonzero(usable & (distance < config.disk_radius * unit))  # eq. 3.1
        through = centre if config.through_centre else None
        best = _best_triple(window, support, through, unit, config, rng)
        if best is not None:
            mask = np.zeros(tracks.points, dtype=bool)
            mask[best[0]] = True
            inliers.append(mask)
            controls.append(place[best[1]])
            foreground.append(fg)
    return AffineModels(
        np.array(inliers, dtype=bool).reshape(len(inliers), tracks.points),
        np.array(controls, dtype=np.float64).reshape(-1, 3, 2),
        np.array(foreground, dtype=bool),
    )


@dataclass(frozen=True)
class _Window:
    """The tracks with the points last: place (2, P) in the base frame, usable (P,) whether they are seen
    there; path (2 (F - 1), P), x and y in turn, and seen (F - 1, P) in the other frames."""

    place: NDArray[np.float64]
    usable: Bools
    path: NDArray[np.float64]
    seen: Bools

    @classmethod
    def of(cls, tracks: Tracks, base: int) -> _Window:
        other = np.arange(tracks.frames) != base  # the base frame maps to itself
        path = tracks.xy[other].transpose(0, 2, 1).reshape(2 * other.sum(), tracks.points)
        return cls(tracks.xy[base].T.copy(), tracks.visible[base], path, tracks.visible[other])


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
    triples = np.array([rng.choice(len(support), 3, replace=False) for _ in range(config.ransac_iterations)])
    if through is not None:
        own = int(np.searchsorted(support, through))
        triples[~(triples == own).any(axis=1), 0] = own
    place = window.place[:, support]
    first = place[:, triples[:, 0]]
    (x1, y1), (x2, y2) = (place[:, triples[:, k]] - first for k in (1, 2))
    twice_area = x1 * y2 - y1 * x2
    wide = np.abs(twice_area) / 2 > _SMALLEST_TRIANGLE * (config.disk_radius * unit) ** 2
    if not wide.any():
        return None
    triples = triples[wide]
    # eq. 3.2: A_{1->f} = [c_f; 1] [c_1; 1]^-1, so a point is transferred by its barycentric coordinates in
    # c_1.
    x, y = place[:, None] - first[:, wide, None]
    (x1, y1), (x2, y2) = ((p[wide, None], q[wide, None]) for p, q in ((x1, y1), (x2, y2)))
    second, third = np.array([x * y2 - y * x2, x1 * y - y1 * x]) / twice_area[wide, None]
    barycentric = np.stack([1 - second - third, second, third], axis=1)
    path, seen = window.path[:, support], window.seen[:, support]
    error = (
        path[:, triples].transpose(1, 0, 2) @ barycentric
    )  # (T, 2 (F - 1), P), NaN where a corner is unseen
    error -= path
    np.multiply(error, error, out=error)
    fits = error[:, ::2] + error[:, 1::2] < (config.inlier_error * unit) ** 2
    counted = seen[:, triples].all(axis=2).T.astype(np.float64) @ seen
    inlier = (fits.sum(axis=1) >= 0.5 * counted) & (counted > 0)
    winner = int(np.argmax(inlier.sum(axis=1)))
    chosen = np.array(inlier[winner])
    chosen[triples[winner]] = True
    return support[chosen], support[triples[winner]]
